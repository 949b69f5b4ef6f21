#include "detection/likelihood_detector.hpp"

#include "detection/expand.hpp"
#include "detection/neighbour_labels.hpp"
#include "detection/neighbourhood.hpp"
#include "detection/seed_patches.hpp"
#include "detection/segment.hpp"
#include "detection/tiles.hpp"
#include "detection/voxel_blocks.hpp"
#include "detection/waiting.hpp"

#include <algorithm>
#include <tsl/robin_set.h>
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

std::vector<Assignment> inliers_of(const MapView& map, const surfaces::SurfaceModel& surface) {
  std::vector<Assignment> inliers;
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    inliers.push_back({map.window.find(inlier.key), surface.id()});
  return inliers;
}

using Places = tsl::robin_set<VoxelBlocks::Place, geometry::PackedKeyHash>;

/// The initial segmentation with seed patches of `candidates`, cells, those that are mostly of pending
/// points: others are parts of the surfaces that expanded there. In the blocks of the seed patches no
/// candidate has a label besides theirs.
Segmentation with_seed_patches_of(const MapView& map, const Readings& readings, const VoxelBlocks& blocks,
                                  std::span<const PointId> candidates, int trials) {
  constexpr Label not_searched = 1;
  Segmentation seed_patches;
  seed_patches.labels.assign(readings.size_with_context(), not_searched);
  seed_patches.patches.resize(2);
  for (const PointId i : candidates) seed_patches.labels[readings.find(i)] = clutter;
  seed_patches = with_seed_patches(readings, std::move(seed_patches), trials);
  std::vector<int> majority(seed_patches.patches.size(), 0);  // pending readings less others
  for (Readings::Index i = 0; i < readings.size(); ++i)
    majority[seed_patches.labels[i]] += readings[i].surface == 0 ? 1 : -1;
  const auto is_new = [&](Label label) { return label > not_searched && majority[label] > 0; };
  Places with_new;
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (is_new(seed_patches.labels[i])) with_new.insert(blocks.of(readings[i].key));
  std::vector<PointId> unlabelled;
  for (const PointId i : candidates)
    if (map.window[i].surface != 0 && with_new.contains(blocks.of(map.window[i].key)))
      unlabelled.push_back(i);
  Segmentation known = known_about(readings, map.surfaces, {}, unlabelled);
  std::vector<Label> into(seed_patches.patches.size(), clutter);
  for (Label label = not_searched + 1; label < into.size(); ++label) {
    if (!is_new(label)) continue;
    into[label] = static_cast<Label>(known.patches.size());
    known.patches.push_back(seed_patches.patches[label]);
  }
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (into[seed_patches.labels[i]] != clutter) known.labels[i] = into[seed_patches.labels[i]];
  return known;
}

}  // namespace

SegmentLimits LikelihoodDetector::limits_in_cells(const MapView& map) const {
  SegmentLimits limits = limits_of(map.cells.map().parameters);
  limits.see_through = departures_.see_through;
  return limits;
}

Proposal LikelihoodDetector::segmented(const MapView& map, const Readings& readings,
                                       Segmentation known) const {
  return proposal_of(map, readings, detection::segment(readings, limits_in_cells(map), std::move(known)));
}

Proposal LikelihoodDetector::segment_all(const MapView& map) const {
  const Readings readings(map);
  Segmentation nothing;
  nothing.labels.assign(readings.size_with_context(), clutter);
  Proposal proposal = segmented(
      map, readings, with_seed_patches(readings, std::move(nothing), departures_.ransac_iterations));
  proposal.unprocessed.clear();
  return proposal;
}

std::optional<Proposal> LikelihoodDetector::segment_points(const MapView& map,
                                                           std::span<const PointId> points,
                                                           std::span<const Assignment> expanded) const {
  const MapView& cells = map.cells.map();
  std::vector<PointId> candidates = map.cells.of(points);
  const VoxelBlocks blocks(seed_patch_edge(cells.grid.resolution()));
  Places with_due;
  for (const PointId i : candidates) with_due.insert(blocks.of(cells.window[i].key));
  std::vector<PointId> beside;
  std::vector<Assignment> elsewhere;
  for (const Assignment& assignment : departures_.takes_back ? expanded : std::span<const Assignment>())
    if (with_due.contains(blocks.of(cells.cell_of(map.window[assignment.point].key))))
      beside.push_back(assignment.point);
    else
      elsewhere.push_back(assignment);
  for (const PointId i : map.cells.of(beside)) candidates.push_back(i);
  const Neighbourhood around = neighbourhood_of(map, candidates, map.cells.of(touching(map, elsewhere)));
  if (around.points.empty()) return {};
  const Readings readings(map, around);
  return segmented(map, readings,
                   with_seed_patches_of(cells, readings, blocks, candidates, departures_.ransac_iterations));
}

std::optional<Proposal> LikelihoodDetector::segment_surfaces(const MapView& map,
                                                             std::span<const SurfaceId> surfaces) const {
  const sensing::ReadingModel model(map.noise, map.grid.resolution());
  const std::size_t largest = largest_looked_at_whole << 2 * map.cells.map().level;
  std::vector<SurfaceId> anew;
  std::vector<PointId> unlabelled, looked_at;
  for (const SurfaceId id : surfaces) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
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
  const Neighbourhood around = neighbourhood_of(map, anew, map.cells.of(looked_at));
  if (around.points.empty()) return {};
  const Readings readings(map, around);
  return segmented(
      map, readings,
      with_seed_patches(readings, known_about(readings, map.surfaces, anew, map.cells.of(unlabelled)),
                        departures_.ransac_iterations));
}

std::vector<Assignment> LikelihoodDetector::add_inliers(const MapView& map,
                                                        std::span<const PointId> fresh) const {
  return detection::add_inliers(map, fresh);
}

std::vector<Assignment> LikelihoodDetector::expand(const MapView& map, std::span<const PointId> left) const {
  return detection::expand(map, left, departures_.guards ? Guards::on : Guards::off);
}

Due LikelihoodDetector::due(const MapView& map, const surfaces::PendingQueue& queue,
                            std::span<const PointId> fresh, std::optional<std::uint64_t> turn) const {
  return due_to_segment(map, queue, fresh, turn);
}

std::optional<Proposal> LikelihoodDetector::segment(const MapView& map, const Part& part) const {
  if (part.all) return segment_all(map);
  return part.surfaces.empty() ? segment_points(map, part.points, part.expanded)
                               : segment_surfaces(map, part.surfaces);
}

std::map<PointId, surfaces::Refusal> LikelihoodDetector::refusals(const MapView& map,
                                                                  std::span<const PointId> pending) const {
  const Readings readings(map, neighbourhood_of(map, map.cells.of(pending), {}));
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
