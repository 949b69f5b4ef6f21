#include "occupancy/downsample.hpp"

#include <algorithm>

#include <octosurf/adapters/detail/parallel.hpp>
#include <octosurf/error.hpp>

namespace octosurf {

std::int64_t Downsampler::find(VoxelKey key) const {
  return std::int64_t{table_.find({key.x, key.y, key.z})} - 1;
}

void Downsampler::add(const Run& run, VoxelScan& out) {
  std::uint32_t& place = table_.at({run.key.x, run.key.y, run.key.z});
  if (place == 0) {
    out.ends.push_back({run.key, 0, Eigen::Vector3f::Zero()});
    place = static_cast<std::uint32_t>(out.ends.size());
  }
  EndVoxel& end = out.ends[place - 1];
  end.count += run.count;
  end.centroid += run.sum;
}

void Downsampler::collect_runs(const Scan& scan, double min_range, std::size_t begin, std::size_t end,
                               Part& part) const {
  const Eigen::Matrix3d R = scan.T_map_sensor.linear();
  const Eigen::Vector3d t = scan.T_map_sensor.translation();
  const double min_range_sq = min_range * min_range;
  part.runs.clear();
  part.not_finite = part.too_near = part.out_of_map = 0;
  Run run;
  VoxelKey key;
  for (std::size_t i = begin; i < end; ++i) {
    const Eigen::Vector3f& p = scan.points[i];
    const Eigen::Vector3d q = p.cast<double>();
    const Eigen::Vector3f in_map = (R * q + t).cast<float>();
    // What is not finite fails one of the two.
    if (!(q.squaredNorm() >= min_range_sq) || !grid_.key_of(in_map, key)) {
      ++(!p.allFinite() ? part.not_finite : q.squaredNorm() < min_range_sq ? part.too_near : part.out_of_map);
      continue;
    }
    if (run.count == 0 || !(key == run.key) || i % longest_run == 0) {
      if (run.count > 0) part.runs.push_back(run);
      run = {key, 0, grid_.centre_of(key), Eigen::Vector3f::Zero()};
    }
    ++run.count;
    run.sum += in_map - run.centre;
  }
  if (run.count > 0) part.runs.push_back(run);
}

VoxelScan Downsampler::operator()(const Scan& scan, double min_range, double max_range, int threads) {
  VoxelScan out;
  out.origin = scan.T_map_sensor.translation().cast<float>();
  out.max_range = max_range;
  if (VoxelKey key; !grid_.key_of(out.origin, key))
    throw Error(Error::Kind::data, scan.name, "the sensor is outside the octree's range",
                "shift the poses nearer to the origin or use a larger resolution");
  table_.clear();
  // Runs end at the same points whatever the number of threads, so sums round alike.
  const std::size_t stretches = scan.points.size() / longest_run + 1;
  parts_.resize(std::min(static_cast<std::size_t>(threads), stretches));
  detail::in_parallel(static_cast<int>(parts_.size()), [&](int t) {
    const detail::Share share(stretches, t, static_cast<int>(parts_.size()));
    collect_runs(scan, min_range, share.begin * longest_run,
                 std::min(share.end * longest_run, scan.points.size()), parts_[static_cast<std::size_t>(t)]);
  });
  for (const Part& part : parts_) {
    for (const Run& run : part.runs) add(run, out);
    out.not_finite += part.not_finite;
    out.too_near += part.too_near;
    out.out_of_map += part.out_of_map;
  }
  for (EndVoxel& end : out.ends) {
    const Eigen::Vector3f centre = grid_.centre_of(end.key);
    if (!out.within_range(centre)) out.beyond_range += end.count;
    end.centroid = centre + end.centroid / static_cast<float>(end.count);
  }
  return out;
}

}  // namespace octosurf
