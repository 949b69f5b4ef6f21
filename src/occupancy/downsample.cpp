#include "occupancy/downsample.hpp"

#include <octosurf/error.hpp>

namespace octosurf {

std::size_t Downsampler::slot_of(std::uint64_t key) const {
  std::size_t i = PackedKeyHash()(key) & (slots_.size() - 1);
  while (slots_[i].key != key && slots_[i].key != empty) i = (i + 1) & (slots_.size() - 1);
  return i;
}

void Downsampler::grow() {
  std::vector<Slot> old(slots_.size() * 2);
  old.swap(slots_);
  for (const Slot& slot : old)
    if (slot.key != empty) slots_[slot_of(slot.key)] = slot;
}

std::int64_t Downsampler::find(VoxelKey key) const {
  if (slots_.empty()) return -1;
  const Slot& slot = slots_[slot_of(key.packed())];
  return slot.key == empty ? -1 : std::int64_t{slot.index};
}

VoxelScan Downsampler::operator()(const Scan& scan, double min_range, double max_range) {
  VoxelScan out;
  out.origin = scan.T_map_sensor.translation().cast<float>();
  out.max_range = max_range;
  VoxelKey last;
  if (!grid_.key_of(out.origin, last))
    throw Error(Error::Kind::data, scan.name, "the sensor is outside the octree's range",
                "shift the poses nearer to the origin or use a larger resolution");

  if (slots_.empty()) slots_.resize(std::size_t{1} << 16);
  std::fill(slots_.begin(), slots_.end(), Slot{});
  const Eigen::Matrix3d R = scan.T_map_sensor.linear();
  const Eigen::Vector3d t = scan.T_map_sensor.translation();
  const double min_range_sq = min_range * min_range;
  std::uint64_t last_packed = empty;
  std::uint32_t last_index = 0;
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
    const Eigen::Vector3f m = (R * q + t).cast<float>();
    VoxelKey key;
    if (!grid_.key_of(m, key)) {
      ++out.out_of_map;
      continue;
    }
    // Neighbouring pixels mostly share a voxel.
    if (const std::uint64_t packed = key.packed(); packed != last_packed) {
      last_packed = packed;
      Slot& slot = slots_[slot_of(packed)];
      if (slot.key == empty) {
        slot = {packed, static_cast<std::uint32_t>(out.ends.size())};
        out.ends.push_back({key, 0, Eigen::Vector3f::Zero()});
        last_index = slot.index;
        if (out.ends.size() * 2 > slots_.size()) grow();
      } else {
        last_index = slot.index;
      }
    }
    EndVoxel& end = out.ends[last_index];
    ++end.count;
    // Summed relative to the voxel's centre: float keeps its digits far from the origin.
    end.centroid += m - grid_.centre_of(key);
  }
  for (EndVoxel& end : out.ends) {
    if (!out.within_range(grid_.centre_of(end.key))) out.beyond_range += end.count;
    end.centroid = grid_.centre_of(end.key) + end.centroid / static_cast<float>(end.count);
  }
  return out;
}

}  // namespace octosurf
