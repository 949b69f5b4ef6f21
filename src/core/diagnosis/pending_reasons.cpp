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
    : state_(state), window_(occupancy::PointWindow::read_only(state.occupancy)) {
  const Parameters& parameters = state.parameters;
  collect_pending(place);
  const occupancy::Neighbours neighbours(window_, parameters.occupancy.resolution);
  const surfaces::MapView view{parameters,     state.occupancy, state.occupancy.grid(),
                               state.surfaces, state.cylinders, state.noise,
                               window_,        neighbours};
  reasons_ = detection::detector_of(parameters, paper).refusals(view, pending_);
}

/// Block by block from those around the place, while neighbours have pending points, too.
void PendingReasons::collect_pending(geometry::VoxelKey place) {
  constexpr std::size_t most_points = 20000;  // effort: a tenth of a second
  const int edge = detection::seed_patch_edge(state_.parameters.occupancy.resolution);
  const detection::VoxelBlocks blocks(edge);
  std::set<detection::VoxelBlocks::Place> known{blocks.of(place)};
  std::deque<detection::VoxelBlocks::Place> waiting(known.begin(), known.end());
  for (; !waiting.empty() && pending_.size() < most_points; waiting.pop_front()) {
    const std::size_t before = pending_.size();
    blocks.for_each_point(window_, waiting.front(), [&](PointId i) {
      if (window_[i].surface == 0) pending_.push_back(i);
    });
    if (pending_.size() == before) continue;
    for (const detection::VoxelBlocks::Place next : blocks.widened({waiting.front()}, edge))
      if (known.insert(next).second) waiting.push_back(next);
  }
  window_.put_in_order(pending_);
}

surfaces::Refusal PendingReasons::of(geometry::VoxelKey key) const {
  if (const CylinderId cylinder = state_.cylinders.owner(key); cylinder != 0)
    return {.reason = Reason::on_cylinder, .cylinder = cylinder};
  const auto found = reasons_.find(window_.find(key));
  if (found != reasons_.end() && found->second.reason == Reason::waiting) return found->second;
  if (stands_alone(key)) return {Reason::isolated};
  return found == reasons_.end() ? surfaces::Refusal{Reason::no_plane} : found->second;
}

bool PendingReasons::stands_alone(geometry::VoxelKey key) const {
  const double radius = state_.parameters.search_radius();
  const Eigen::Vector3f at = window_[window_.find(key)].position;
  const auto is_near = [&](PointId other) {
    return (window_[other].position - at).cast<double>().norm() <= radius;
  };
  return std::count_if(pending_.begin(), pending_.end(), is_near) < 3;  // itself, and fewer than two others
}

std::map<Reason, std::size_t> PendingReasons::within(double radius, const Eigen::Vector3d& at) const {
  std::map<Reason, std::size_t> counts;
  for (const PointId i : pending_)
    if ((window_[i].position.cast<double>() - at).norm() <= radius) ++counts[of(window_[i].key).reason];
  return counts;
}

}  // namespace octosurf::diagnosis
