#include "diagnosis/pending_reasons.hpp"

#include "detection/detector.hpp"
#include "detection/seed_patches.hpp"
#include "detection/voxel_blocks.hpp"

#include <algorithm>
#include <deque>
#include <set>

namespace octosurf::diagnosis {

PendingReasons::PendingReasons(const surfaces::MapState& state, geometry::VoxelKey place,
                               const detection::Detector* paper)
    : view_(state) {
  collect_pending(place);
  reasons_ = detection::detector_of(state.parameters, paper).refusals(view_, pending_);
}

/// Block by block from those around the place, while neighbours have pending points, too.
void PendingReasons::collect_pending(geometry::VoxelKey place) {
  constexpr std::size_t most_points = 20000;  // effort: a tenth of a second
  const int edge = detection::seed_patch_edge(view_.parameters.occupancy.resolution);
  const detection::VoxelBlocks blocks(edge);
  std::set<detection::VoxelBlocks::Place> known{blocks.of(place)};
  std::deque<detection::VoxelBlocks::Place> waiting(known.begin(), known.end());
  for (; !waiting.empty() && pending_.size() < most_points; waiting.pop_front()) {
    const std::size_t before = pending_.size();
    blocks.for_each_point(view_.window, waiting.front(), [&](PointId i) {
      if (view_.window[i].surface == 0) pending_.push_back(i);
    });
    if (pending_.size() == before) continue;
    for (const detection::VoxelBlocks::Place next : blocks.widened({waiting.front()}, edge))
      if (known.insert(next).second) waiting.push_back(next);
  }
  view_.window.put_in_order(pending_);
}

surfaces::Refusal PendingReasons::of(geometry::VoxelKey key) const {
  if (const CylinderId cylinder = view_.cylinders.owner(key); cylinder != 0)
    return {.reason = Reason::on_cylinder, .cylinder = cylinder};
  const auto found = reasons_.find(view_.window.find(key));
  if (found != reasons_.end() && found->second.reason == Reason::waiting) return found->second;
  if (stands_alone(key)) return {Reason::isolated};
  return found == reasons_.end() ? surfaces::Refusal{Reason::no_plane} : found->second;
}

bool PendingReasons::stands_alone(geometry::VoxelKey key) const {
  const double radius = view_.parameters.search_radius();
  const Eigen::Vector3f at = view_.window[view_.window.find(key)].position;
  const auto is_near = [&](PointId other) {
    return (view_.window[other].position - at).cast<double>().norm() <= radius;
  };
  return std::count_if(pending_.begin(), pending_.end(), is_near) < 3;  // itself, and fewer than two others
}

std::map<Reason, std::size_t> PendingReasons::within(double radius, const Eigen::Vector3d& at) const {
  std::map<Reason, std::size_t> counts;
  for (const PointId i : pending_)
    if ((view_.window[i].position.cast<double>() - at).norm() <= radius)
      ++counts[of(view_.window[i].key).reason];
  return counts;
}

}  // namespace octosurf::diagnosis
