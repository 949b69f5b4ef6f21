#include "detection/likelihood_detector.hpp"

#include "detection/expand.hpp"
#include "detection/neighbourhood.hpp"
#include "detection/segment.hpp"
#include "detection/tiles.hpp"
#include "detection/waiting.hpp"

#include <algorithm>

namespace octosurf::detection {
namespace {

using geometry::VoxelKey;
using surfaces::MapView;

/// Effort, readings: larger surfaces are segmented only where their tiles disagree, mostly a twentieth, and
/// where they meet surfaces that may be one with them. Segmenting smaller ones entirely also decides readings
/// at their rims and across gaps: by tiles alone ten of 350 faces are lost with lasers.
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
  return proposal;
}

std::vector<Assignment> inliers_of(const MapView& map, const surfaces::SurfaceModel& surface) {
  std::vector<Assignment> inliers;
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    inliers.push_back({map.window.find(inlier.key), surface.id()});
  return inliers;
}

/// `anew`: surfaces whose inliers start without a label; `unlabelled`: other surfaces' inliers that do.
/// Unseen remains a part of the planes rejected for their number.
std::optional<Proposal> segment_in(const MapView& map, const Neighbourhood& around,
                                   std::span<const SurfaceId> anew, std::span<const PointId> unlabelled) {
  if (around.points.empty()) return {};
  const Readings readings(map, around);
  const Segmentation found =
      segment(readings, limits_of(map.parameters), known_about(readings, map.surfaces, anew, unlabelled));
  Proposal proposal = proposal_of(readings, found);
  proposal.unseen = waiting_on(too_few(readings, found));
  return proposal;
}

}  // namespace

std::vector<Assignment> LikelihoodDetector::add_inliers(const MapView& map,
                                                        std::span<const PointId> fresh) const {
  return detection::add_inliers(map, fresh);
}

std::vector<Assignment> LikelihoodDetector::expand(const MapView& map, std::span<const PointId> left) const {
  return detection::expand(map, left);
}

Due LikelihoodDetector::due(const MapView& map, const surfaces::PendingQueue& queue,
                            std::span<const PointId> fresh, bool all,
                            std::span<const Assignment> expanded) const {
  return due_to_segment(map, queue, fresh, all, expanded);
}

std::optional<Proposal> LikelihoodDetector::detect(const MapView& map, std::span<const PointId> due,
                                                   std::span<const Assignment> expanded) const {
  return segment_in(map, neighbourhood_of(map, due, touching(map, expanded)), {}, {});
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
  return segment_in(map, neighbourhood_of(map, anew, looked_at), anew, unlabelled);
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
      segment(readings, limits_of(map.parameters), known_about(readings, map.surfaces, {}), &refused);
  std::map<PointId, surfaces::Refusal> reasons;
  for (const Refused& plane : refused)
    for (const Readings::Index i : plane.readings) reasons[readings[i].point] = plane.why;
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (found.labels[i] != clutter) reasons[readings[i].point] = {Reason::waiting};
  return reasons;
}

}  // namespace octosurf::detection
