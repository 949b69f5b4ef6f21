#include "occupancy/downsample.hpp"

#include <octosurf/error.hpp>

namespace octosurf {

std::size_t Downsampler::slot_of(std::uint64_t cube) const {
  std::size_t i = PackedKeyHash()(cube) & (slots_.size() - 1);
  while (slots_[i].cube != cube && slots_[i].cube != empty) i = (i + 1) & (slots_.size() - 1);
  return i;
}

std::uint32_t Downsampler::cube_index(std::uint64_t cube) {
  Slot& slot = slots_[slot_of(cube)];
  if (slot.cube == cube) return slot.index;
  const auto index = static_cast<std::uint32_t>(used_++);
  slot = {cube, index};
  if (used_ > cubes_.size())
    cubes_.emplace_back();
  else
    cubes_[index].fill(0);
  if (used_ * 2 > slots_.size()) {
    std::vector<Slot> old(slots_.size() * 2);
    old.swap(slots_);
    for (const Slot& s : old)
      if (s.cube != empty) slots_[slot_of(s.cube)] = s;
  }
  return index;
}

void Downsampler::clear() {
  if (slots_.empty()) slots_.resize(std::size_t{1} << 12);
  std::fill(slots_.begin(), slots_.end(), Slot{});
  used_ = 0;
  last_cube_ = empty;
}

std::int64_t Downsampler::find(VoxelKey key) const {
  if (slots_.empty()) return -1;
  const Slot& slot = slots_[slot_of(cube_of(key))];
  return slot.cube == empty ? -1 : std::int64_t{cubes_[slot.index][place_in_cube(key)]} - 1;
}

void Downsampler::group(const Eigen::Vector3f& in_map, VoxelKey key, VoxelScan& out) {
  if (const std::uint64_t cube = cube_of(key); cube != last_cube_) {
    last_cube_ = cube;
    last_index_ = cube_index(cube);
  }
  std::uint32_t& place = cubes_[last_index_][place_in_cube(key)];
  if (place == 0) {
    out.ends.push_back({key, 0, Eigen::Vector3f::Zero()});
    place = static_cast<std::uint32_t>(out.ends.size());
  }
  EndVoxel& end = out.ends[place - 1];
  ++end.count;
  // Summed relative to the voxel's centre: float keeps its digits far from the origin.
  end.centroid += in_map - grid_.centre_of(key);
}

VoxelScan Downsampler::operator()(const Scan& scan, double min_range, double max_range) {
  VoxelScan out;
  out.origin = scan.T_map_sensor.translation().cast<float>();
  out.max_range = max_range;
  VoxelKey key;
  if (!grid_.key_of(out.origin, key))
    throw Error(Error::Kind::data, scan.name, "the sensor is outside the octree's range",
                "shift the poses nearer to the origin or use a larger resolution");
  clear();
  const Eigen::Matrix3d R = scan.T_map_sensor.linear();
  const Eigen::Vector3d t = scan.T_map_sensor.translation();
  const double min_range_sq = min_range * min_range;
  for (const Eigen::Vector3f& p : scan.points) {
    if (!p.allFinite()) {
      ++out.not_finite;
      continue;
    }
    const Eigen::Vector3d q = p.cast<double>();
    if (q.squaredNorm() < min_range_sq) {
      ++out.too_near;
      continue;
    }
    const Eigen::Vector3f in_map = (R * q + t).cast<float>();
    if (grid_.key_of(in_map, key))
      group(in_map, key, out);
    else
      ++out.out_of_map;
  }
  for (EndVoxel& end : out.ends) {
    const Eigen::Vector3f centre = grid_.centre_of(end.key);
    if (!out.within_range(centre)) out.beyond_range += end.count;
    end.centroid = centre + end.centroid / static_cast<float>(end.count);
  }
  return out;
}

}  // namespace octosurf
