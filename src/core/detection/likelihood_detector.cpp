#include "detection/likelihood_detector.hpp"

#include "detection/expand.hpp"
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

/// The pending readings of planes rejected for their number alone.
std::vector<PointId> too_few(const Readings& readings, const Segmentation& planes) {
  std::vector<PointId> points;
  for (const Readings::Index i : planes.too_few)
    if (readings[i].surface == 0 && planes.labels[i] == clutter) points.push_back(readings[i].point);
  return points;
}

Proposal proposal_of(const Readings& readings, const Segmentation& found) {
  Proposal proposal;
  for (Label label = 1; label < found.patches.size(); ++label)
    proposal.planes.push_back({found.patches[label].plane, found.patches[label].centroid()});
  for (Readings::Index i = 0; i < readings.size(); ++i)
    proposal.points.push_back({readings[i].point, found.labels[i]});
  for (const Outside& part : found.outside)
    proposal.rest.push_back({part.surface, part.label, part.sums.readings});
  for (const std::vector<Readings::Index>& patch : found.curved) {
    std::vector<PointId>& points = proposal.curved.emplace_back();
    for (const Readings::Index i : patch) points.push_back(readings[i].point);
  }
  return proposal;
}

std::vector<Assignment> inliers_of(const MapView& map, const surfaces::SurfaceModel& surface) {
  std::vector<Assignment> inliers;
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    inliers.push_back({map.window.find(inlier.key), surface.id()});
  return inliers;
}

/// Unseen remains a part of the planes rejected for their number.
Proposal segmented(const MapView& map, const Readings& readings, Segmentation known) {
  const Segmentation found = segment(readings, limits_of(map.parameters), std::move(known));
  Proposal proposal = proposal_of(readings, found);
  proposal.unprocessed = waiting_on(too_few(readings, found));
  return proposal;
}

using Places = tsl::robin_set<VoxelBlocks::Place, geometry::PackedKeyHash>;

/// The initial segmentation with seed patches of `candidates`, those that are mostly of pending points:
/// others are parts of the surfaces that expanded there. In the blocks of the seed patches no candidate has a
/// label besides theirs.
Segmentation with_seed_patches_of(const MapView& map, const Readings& readings, const VoxelBlocks& blocks,
                                  std::span<const PointId> candidates) {
  constexpr Label not_searched = 1;
  Segmentation seed_patches;
  seed_patches.labels.assign(readings.size_with_context(), not_searched);
  seed_patches.patches.resize(2);
  for (const PointId i : candidates) seed_patches.labels[readings.find(i)] = clutter;
  seed_patches = with_seed_patches(readings, std::move(seed_patches));
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

std::vector<Assignment> LikelihoodDetector::add_inliers(const MapView& map,
                                                        std::span<const PointId> fresh) const {
  return detection::add_inliers(map, fresh);
}

std::vector<Assignment> LikelihoodDetector::expand(const MapView& map, std::span<const PointId> left) const {
  return detection::expand(map, left);
}

Detection LikelihoodDetector::detect(const MapView& map, const surfaces::PendingQueue& queue,
                                     std::span<const PointId> fresh, bool all,
                                     std::span<const Assignment> expanded) const {
  Due due = due_to_segment(map, queue, fresh, all);
  Detection result{.found = {}, .segmented = {}, .left = std::move(due.left), .waiting = due.waiting};
  const VoxelBlocks blocks(seed_patch_edge(map.grid.resolution()));
  Places with_due;
  for (const PointId i : due.points) with_due.insert(blocks.of(map.window[i].key));
  std::vector<PointId> candidates = due.points;
  std::vector<Assignment> elsewhere;
  for (const Assignment& assignment : expanded)
    if (with_due.contains(blocks.of(map.window[assignment.point].key)))
      candidates.push_back(assignment.point);
    else
      elsewhere.push_back(assignment);
  const Neighbourhood around = neighbourhood_of(map, candidates, touching(map, elsewhere));
  if (!around.points.empty()) {
    const Readings readings(map, around);
    result.found = segmented(map, readings, with_seed_patches_of(map, readings, blocks, candidates));
  }
  result.segmented = std::move(due.points);
  return result;
}

std::optional<Proposal> LikelihoodDetector::revise(const MapView& map,
                                                   const std::set<SurfaceId>& changed) const {
  const sensing::ReadingModel model(map.noise, map.grid.resolution());
  std::vector<SurfaceId> anew;
  std::vector<PointId> unlabelled, looked_at;
  for (const SurfaceId id : changed) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
    std::vector<PointId> disagree;
    if (surface.size() > largest_looked_at_whole)
      for (const VoxelKey key : where_tiles_disagree(surface, model))
        disagree.push_back(map.window.find(key));
    if (surface.size() <= largest_looked_at_whole || 2 * disagree.size() > surface.size()) {
      anew.push_back(id);
      continue;
    }
    unlabelled.insert(unlabelled.end(), disagree.begin(), disagree.end());
    const std::vector<PointId> beside_its_like = touching(map, inliers_of(map, surface));
    looked_at.insert(looked_at.end(), beside_its_like.begin(), beside_its_like.end());
  }
  looked_at.insert(looked_at.end(), unlabelled.begin(), unlabelled.end());
  const Neighbourhood around = neighbourhood_of(map, anew, looked_at);
  if (around.points.empty()) return {};
  const Readings readings(map, around);
  return segmented(map, readings,
                   with_seed_patches(readings, known_about(readings, map.surfaces, anew, unlabelled)));
}

Proposal LikelihoodDetector::detect_anew(const MapView& map) const {
  const Readings readings(map);
  return proposal_of(readings, segment(readings, limits_of(map.parameters)));
}

std::map<PointId, surfaces::Refusal> LikelihoodDetector::refusals(const MapView& map,
                                                                  std::span<const PointId> pending) const {
  const Readings readings(map, neighbourhood_of(map, pending, {}));
  std::vector<Refused> refused;
  const Segmentation found =
      segment(readings, limits_of(map.parameters),
              with_seed_patches(readings, known_about(readings, map.surfaces, {})), &refused);
  std::map<PointId, surfaces::Refusal> reasons;
  for (const Refused& plane : refused)
    for (const Readings::Index i : plane.readings) reasons[readings[i].point] = plane.why;
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (found.labels[i] != clutter) reasons[readings[i].point] = {Reason::waiting};
  return reasons;
}

}  // namespace octosurf::detection
