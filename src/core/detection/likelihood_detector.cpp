#include "detection/likelihood_detector.hpp"

#include "detection/expand.hpp"
#include "detection/neighbour_labels.hpp"
#include "detection/neighbourhood.hpp"
#include "detection/seed_patches.hpp"
#include "detection/segment.hpp"
#include "detection/tiles.hpp"
#include "detection/waiting.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace octosurf::detection {
namespace {

using geometry::VoxelKey;
using surfaces::MapView;

/// Effort, readings: larger surfaces are segmented only where their tiles disagree, mostly a twentieth, and
/// where they meet surfaces that may be one with them. Segmenting smaller ones entirely also decides readings
/// at their boundaries and across gaps: by tiles alone ten of 350 faces are lost with lasers.
constexpr std::size_t largest_looked_at_whole = 5000;

/// The labels of voxels. One in each cell has the cell's; the others get the best one of those in and beside
/// it.
class VoxelLabels {
 public:
  VoxelLabels(const MapView& map, const Readings& readings, const Segmentation& found)
      : map_(map), readings_(readings), found_(found) {
    for (Index i = 0; i < readings.size(); ++i) {
      NeighbourLabels near;
      near.add(found.labels[i]);
      for (const Index j : readings.near(i)) near.add(found.labels[j]);
      bool first = true;
      readings.for_each_voxel(i, [&](PointId voxel, const VoxelPoint& p) {
        const Label label = std::exchange(first, false) ? found.labels[i] : best_of(near, p);
        if (label != clutter || !stays(p, readings[i].surface)) labelled_.push_back({voxel, label});
      });
    }
  }
  std::vector<Proposal::Labelled> take() && { return std::move(labelled_); }

 private:
  using Index = Readings::Index;
  using VoxelPoint = occupancy::VoxelPoint;

  double log_ratio(const VoxelPoint& p, const Plane& plane) const {
    return readings_.model().log_ratio(plane.signed_distance(p.position.cast<double>()), p.range_class,
                                       plane.normal.dot(p.view.cast<double>()));
  }
  Label best_of(const NeighbourLabels& near, const VoxelPoint& p) const {
    return near.best([&](Label label) { return log_ratio(p, found_.patches[label].plane); });
  }
  /// It has another surface than its cell, one that is not beside it and still explains it.
  bool stays(const VoxelPoint& p, SurfaceId of_cell) const {
    return p.surface != 0 && p.surface != of_cell && log_ratio(p, map_.surfaces.find(p.surface)->plane()) > 0;
  }

  const MapView& map_;
  const Readings& readings_;
  const Segmentation& found_;
  std::vector<Proposal::Labelled> labelled_;
};

/// The planes with at least n voxels: as many cells may have fewer.
Proposal proposal_of(const MapView& map, const Readings& readings, const Segmentation& found) {
  Proposal proposal;
  proposal.points = VoxelLabels(map, readings, found).take();
  std::map<SurfaceId, std::size_t> inside;
  std::vector<std::size_t> sizes(found.patches.size(), 0);
  for (const auto& [voxel, label] : proposal.points) {
    ++inside[map.window[voxel].surface];
    ++sizes[label];
  }
  for (const Outside& part : found.outside) {
    const std::size_t rest = map.surfaces.find(part.surface)->size() - inside[part.surface];
    proposal.rest.push_back({part.surface, part.label, static_cast<double>(rest)});
    sizes[part.label] += rest;
  }
  std::vector<Label> into(found.patches.size(), clutter);
  for (Label label = 1; label < found.patches.size(); ++label) {
    if (sizes[label] < static_cast<std::size_t>(map.parameters.min_surface_points())) continue;
    into[label] = static_cast<Label>(proposal.planes.size());
    proposal.planes.push_back({found.patches[label].plane, found.patches[label].centroid()});
  }
  for (Proposal::Rest& rest : proposal.rest) rest.label = into[rest.label];
  std::vector<PointId> too_few;
  for (auto& [voxel, label] : proposal.points) {
    if (label != clutter && into[label] == clutter && map.is_pending(voxel)) too_few.push_back(voxel);
    label = into[label];
  }
  for (const Readings::Index i : found.too_few)
    if (readings[i].surface == 0 && found.labels[i] == clutter)
      readings.for_each_voxel(i, [&](PointId voxel, const auto& p) {
        if (p.surface == 0) too_few.push_back(voxel);
      });
  proposal.unprocessed = waiting_on(too_few);
  for (const std::vector<Readings::Index>& patch : found.curved) {
    std::vector<PointId>& points = proposal.curved.emplace_back();
    for (const Readings::Index i : patch)
      readings.for_each_voxel(i, [&](PointId voxel, const auto&) { points.push_back(voxel); });
  }
  return proposal;
}

std::vector<PointId> inliers_of(const MapView& map, const surfaces::SurfaceModel& surface) {
  std::vector<PointId> inliers;
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    inliers.push_back(map.window.find(inlier.key));
  return inliers;
}

}  // namespace

SegmentLimits LikelihoodDetector::limits_in_cells(const MapView& map) const {
  SegmentLimits limits = limits_of(map.cells.map().parameters);
  limits.see_through = see_through_;
  return limits;
}

Proposal LikelihoodDetector::segmented(const MapView& map, const Readings& readings,
                                       Segmentation known) const {
  return proposal_of(
      map, readings,
      detection::segment(readings, limits_in_cells(map), with_seed_patches(readings, std::move(known))));
}

Proposal LikelihoodDetector::segment_all(const MapView& map) const {
  const Readings readings(map);
  Segmentation nothing;
  nothing.labels.assign(readings.size_with_context(), clutter);
  Proposal proposal = segmented(map, readings, std::move(nothing));
  proposal.unprocessed.clear();
  return proposal;
}

std::optional<Proposal> LikelihoodDetector::segment_leftovers(const MapView& map,
                                                              std::span<const PointId> points) const {
  if (points.empty()) return {};
  const Readings readings(map, neighbourhood_of(map, map.cells.of(points)));
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (readings[i].surface != 0) throw std::logic_error("detection: a reading of a surface is no leftover");
  Proposal proposal = segmented(map, readings, known_about(readings, map.surfaces, {}));
  // Some voxels of a pending cell may belong to a surface, and surfaces of which a few readings are here are
  // not judged by these.
  std::erase_if(proposal.points, [&](const auto& labelled) { return !map.is_pending(labelled.point); });
  std::erase_if(proposal.rest, [](const auto& rest) { return rest.label == clutter; });
  return proposal;
}

std::optional<Proposal> LikelihoodDetector::revise(const MapView& map, std::span<const SurfaceId> surfaces,
                                                   std::span<const PointId> gained) const {
  const sensing::ReadingModel model(map.noise, map.grid.resolution());
  const std::size_t largest = largest_looked_at_whole << 2 * map.cells.map().level;
  std::vector<SurfaceId> anew;
  std::vector<PointId> unlabelled, looked_at = touching(map, gained);
  for (const SurfaceId id : surfaces) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
    if (!surface.size_has_changed()) {
      const std::vector<PointId> its = inliers_of(map, surface);
      looked_at.insert(looked_at.end(), its.begin(), its.end());
      continue;
    }
    std::vector<PointId> disagree;
    if (surface.size() > largest)
      for (const VoxelKey key : where_tiles_disagree(surface, model))
        disagree.push_back(map.window.find(key));
    if (surface.size() <= largest || 2 * disagree.size() > surface.size()) {
      anew.push_back(id);
      continue;
    }
    unlabelled.insert(unlabelled.end(), disagree.begin(), disagree.end());
    const std::vector<PointId> beside_its_like = touching(map, inliers_of(map, surface));
    looked_at.insert(looked_at.end(), beside_its_like.begin(), beside_its_like.end());
  }
  looked_at.insert(looked_at.end(), unlabelled.begin(), unlabelled.end());
  const Neighbourhood around = neighbourhood_of(map, map.cells.of(looked_at), anew);
  if (around.points.empty()) return {};
  const Readings readings(map, around);
  return segmented(map, readings, known_about(readings, map.surfaces, anew, map.cells.of(unlabelled)));
}

std::vector<Assignment> LikelihoodDetector::add_inliers(const MapView& map,
                                                        std::span<const PointId> fresh) const {
  return detection::add_inliers(map, fresh);
}

std::vector<Assignment> LikelihoodDetector::expand(const MapView& map, std::span<const PointId> fresh) const {
  return detection::expand(map, fresh);
}

Due LikelihoodDetector::due(const MapView& map, const surfaces::PendingQueue& queue,
                            std::span<const PointId> fresh, std::optional<std::uint64_t> turn) const {
  return due_to_segment(map, queue, fresh, turn);
}

std::optional<Proposal> LikelihoodDetector::segment(const MapView& map, const Part& part) const {
  if (part.all) return segment_all(map);
  return part.points.empty() ? revise(map, part.surfaces, part.gained) : segment_leftovers(map, part.points);
}

std::map<PointId, surfaces::Refusal> LikelihoodDetector::refusals(const MapView& map,
                                                                  std::span<const PointId> pending) const {
  const Readings readings(map, neighbourhood_of(map, map.cells.of(pending)));
  std::vector<Refused> refused;
  const Segmentation found =
      detection::segment(readings, limits_in_cells(map),
                         with_seed_patches(readings, known_about(readings, map.surfaces, {})), &refused);
  std::map<PointId, surfaces::Refusal> reasons;
  for (const Refused& plane : refused)
    for (const Readings::Index i : plane.readings)
      readings.for_each_voxel(i, [&](PointId voxel, const auto&) { reasons[voxel] = plane.why; });
  for (const auto& [voxel, label] : VoxelLabels(map, readings, found).take())
    if (label != clutter) reasons[voxel] = {Reason::waiting};
  return reasons;
}

}  // namespace octosurf::detection
