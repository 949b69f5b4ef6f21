#include "detection/likelihood_detector.hpp"

#include "detection/expansion.hpp"
#include "detection/neighbour_labels.hpp"
#include "detection/neighbourhood.hpp"
#include "detection/parts.hpp"
#include "detection/seed_patches.hpp"

#include <stdexcept>
#include <utility>

namespace octosurf::detection {
namespace {

using geometry::VoxelKey;
using surfaces::MapView;

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

  Label best_of(const NeighbourLabels<>& near, const VoxelPoint& p) const {
    return near.best(
        [&](Label label) { return readings_.model().log_ratio(p, found_.patches[label].plane); });
  }
  /// It has another surface than its cell, one that is not beside it and still explains it.
  bool stays(const VoxelPoint& p, SurfaceId of_cell) const {
    return p.surface != 0 && p.surface != of_cell &&
           readings_.model().belongs(p, map_.surfaces.find(p.surface)->plane());
  }

  const MapView& map_;
  const Readings& readings_;
  const Segmentation& found_;
  std::vector<Proposal::Labelled> labelled_;
};

/// All planes, and in `unprocessed` all points of those that had too few.
Proposal proposal_of(const MapView& map, const Readings& readings, const Segmentation& found) {
  Proposal proposal;
  proposal.points = VoxelLabels(map, readings, found).take();
  for (Label label = 1; label < found.patches.size(); ++label)
    proposal.planes.push_back({found.patches[label].plane, found.patches[label].centroid()});
  for (const Outside& part : found.outside) proposal.rest.push_back({part.surface, part.label, 0});
  for (const Readings::Index i : found.too_few)
    if (readings[i].surface == 0 && found.labels[i] == clutter)
      readings.for_each_voxel(i, [&](PointId voxel, const auto& p) {
        if (p.surface == 0) proposal.unprocessed.push_back(voxel);
      });
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

/// Adds the cells of other surfaces beside these inliers that the surface explains, too.
void add_contested(const MapView& map, SurfaceId id, std::span<const PointId> inliers,
                   std::vector<PointId>& cells) {
  const MapView& coarse = map.cells.map();
  SurePlanes planes(coarse);
  for (const PointId i : inliers)
    for (const PointId j : coarse.neighbours.of(map.cells.of(i)))
      if (const SurfaceId other = coarse.window[j].surface;
          other != 0 && other != id && planes.log_ratio(id, j) > 0)
        cells.push_back(j);
}

/// Effort, cells: larger surfaces whose size has changed are segmented only where they meet others that may
/// be one with them. As they grew to this size they were segmented whole at each doubling.
constexpr std::size_t largest_segmented_whole = 5000;

/// What is segmented of a part: surfaces whose size has changed start without labels, the other ones with
/// theirs, and so do the cells beside these which both explain.
struct ToLabel {
  std::vector<SurfaceId> anew;
  Neighbourhood around;
};

ToLabel labelled_in(const MapView& map, const Part& part) {
  ToLabel result;
  std::vector<PointId> cells;
  const auto add = [&](const std::vector<PointId>& voxels) {
    for (const PointId i : voxels) cells.push_back(map.cells.of(i));
  };
  add(touching(map, part.gained));
  add(part.points);
  for (const SurfaceId id : part.surfaces) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
    const std::vector<PointId> its = inliers_of(map, surface);
    if (!surface.size_has_changed()) {
      add(its);
      add_contested(map, id, its, cells);
    } else if (surface.size() >> 2 * map.cells.map().level <= largest_segmented_whole) {
      result.anew.push_back(id);
    } else {
      add(touching(map, its));
    }
  }
  result.around = neighbourhood_of(map, cells, result.anew);
  return result;
}

}  // namespace

Segmentation LikelihoodDetector::segmented(const MapView& map, const Readings& readings, Segmentation known,
                                           std::vector<Refused>* refused) const {
  SegmentLimits limits = limits_of(map.cells.map().parameters);
  limits.see_through = see_through_;
  return detection::segment(readings, limits, with_seed_patches(readings, std::move(known)), refused);
}

std::optional<Proposal> LikelihoodDetector::segment(const MapView& map, const Part& part, int threads) const {
  const std::vector<Part> parts = divided(map, part);
  if (parts.empty()) return {};
  std::vector<std::pair<Proposal, const occupancy::PointWindow*>> found(parts.size());
  look_at_parts(map, parts, threads, [&](std::size_t k, const MapView& view, const Part& its) {
    const ToLabel to_label = labelled_in(view, its);
    const Readings readings(view, to_label.around);
    for (Readings::Index i = 0; i < readings.size() && !its.points.empty(); ++i)
      if (readings[i].surface != 0)
        throw std::logic_error("detection: a reading of a surface is no leftover");
    found[k] = {proposal_of(view, readings,
                            segmented(view, readings, known_about(readings, view.surfaces, to_label.anew))),
                &view.window};
  });
  JointProposal joint(map);
  for (const auto& [proposal, window] : found) joint.add(proposal, *window);
  Proposal proposal = std::move(joint).take();
  // Some voxels of a pending cell may belong to a surface, and surfaces of which a few readings are here are
  // not judged by these.
  if (!part.points.empty()) {
    std::erase_if(proposal.points, [&](const auto& labelled) { return !map.is_pending(labelled.point); });
    std::erase_if(proposal.rest, [](const auto& rest) { return rest.label == clutter; });
  }
  proposal.unprocessed = waiting_on(proposal.unprocessed);
  return proposal;
}

std::vector<Assignment> LikelihoodDetector::expand(const MapView& map, std::span<const PointId> fresh,
                                                   int threads) const {
  const std::vector<Part> parts = divided(map, {.points = {fresh.begin(), fresh.end()}});
  std::vector<std::vector<std::pair<VoxelKey, SurfaceId>>> gained(parts.size());
  look_at_parts(map, parts, threads, [&](std::size_t k, const MapView& view, const Part& its) {
    for (const auto& [point, id] : detection::expand(view, its.points))
      gained[k].emplace_back(view.window[point].key, id);
  });
  std::vector<Assignment> all;
  occupancy::PointSet taken;
  for (const auto& of_part : gained)
    for (const auto& [key, id] : of_part)
      if (const PointId i = map.window.find(key); taken.insert(i)) all.push_back({i, id});
  return all;
}

std::map<PointId, surfaces::Refusal> LikelihoodDetector::refusals(const MapView& map,
                                                                  std::span<const PointId> pending) const {
  const Readings readings(map, neighbourhood_of(map, map.cells.of(pending)));
  std::vector<Refused> refused;
  const Segmentation found = segmented(map, readings, known_about(readings, map.surfaces, {}), &refused);
  std::map<PointId, surfaces::Refusal> reasons;
  for (const Refused& plane : refused)
    for (const Readings::Index i : plane.readings)
      readings.for_each_voxel(i, [&](PointId voxel, const auto&) { reasons[voxel] = plane.why; });
  for (const auto& [voxel, label] : VoxelLabels(map, readings, found).take())
    if (label != clutter) reasons[voxel] = {Reason::waiting};
  return reasons;
}

}  // namespace octosurf::detection
