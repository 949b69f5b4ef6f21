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
std::vector<VoxelKey> too_few(const Readings& readings, const Segmentation& planes) {
  std::vector<VoxelKey> keys;
  for (const Readings::Index i : planes.too_few)
    if (readings[i].surface == 0 && planes.labels[i] == clutter) keys.push_back(readings[i].key);
  return keys;
}

std::vector<Assignment> inliers_of(const MapView& map, const surfaces::SurfaceModel& surface) {
  std::vector<Assignment> inliers;
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    inliers.push_back({map.window.find(inlier.key), surface.id()});
  return inliers;
}

/// `anew`: surfaces whose inliers start without a label; `unlabelled`: other surfaces' inliers that do.
std::optional<FoundPlanes> segment_in(const MapView& map, const occupancy::OccupancyMap& octree,
                                      const Neighbourhood& around, std::span<const SurfaceId> anew,
                                      std::span<const VoxelKey> unlabelled) {
  if (around.voxels.empty()) return {};
  std::optional<FoundPlanes> found(std::in_place, Readings(octree, map.window, around, map.noise));
  found->planes = segment(found->readings, limits_of(map.parameters),
                          known_about(found->readings, map.surfaces, anew, unlabelled));
  found->beside = newly_explained(*found);
  return found;
}

}  // namespace

std::vector<Assignment> LikelihoodDetector::add_inliers(const MapView& map,
                                                        std::span<const VoxelKey> fresh) const {
  return detection::add_inliers(map, fresh);
}

std::vector<Assignment> LikelihoodDetector::expand(const MapView& map, std::span<const VoxelKey> left) const {
  return detection::expand(map, left);
}

Due LikelihoodDetector::due(const MapView& map, const occupancy::OccupancyMap& octree,
                            surfaces::PendingQueue before, std::span<const VoxelKey> fresh, bool all,
                            std::vector<Assignment>& expanded) const {
  return due_to_segment(map, octree, std::move(before), fresh, all, expanded);
}

std::optional<FoundPlanes> LikelihoodDetector::detect(const MapView& map,
                                                      const occupancy::OccupancyMap& octree,
                                                      std::span<const VoxelKey> due,
                                                      std::span<const Assignment> expanded) const {
  std::optional<FoundPlanes> found =
      segment_in(map, octree, neighbourhood_of(map, due, touching(map, expanded)), {}, {});
  if (found) found->still_new = waiting_on(too_few(found->readings, found->planes));
  return found;
}

std::optional<FoundPlanes> LikelihoodDetector::revise(const MapView& map,
                                                      const occupancy::OccupancyMap& octree,
                                                      const std::set<SurfaceId>& changed) const {
  const sensing::ReadingModel model(map.noise, map.grid.resolution());
  std::vector<SurfaceId> anew;
  std::vector<VoxelKey> unlabelled, looked_at;
  for (const SurfaceId id : changed) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
    std::vector<VoxelKey> disagree;
    if (surface.size() > largest_looked_at_whole) disagree = where_tiles_disagree(surface, model);
    if (surface.size() <= largest_looked_at_whole || 2 * disagree.size() > surface.size()) {
      anew.push_back(id);
      continue;
    }
    unlabelled.insert(unlabelled.end(), disagree.begin(), disagree.end());
    const std::vector<VoxelKey> beside_its_like = touching(map, inliers_of(map, surface));
    looked_at.insert(looked_at.end(), beside_its_like.begin(), beside_its_like.end());
  }
  looked_at.insert(looked_at.end(), unlabelled.begin(), unlabelled.end());
  return segment_in(map, octree, neighbourhood_of(map, anew, looked_at), anew, unlabelled);
}

std::vector<std::pair<SurfaceId, Plane>> LikelihoodDetector::fit(const MapView& map,
                                                                 const std::set<SurfaceId>& surfaces) const {
  std::vector<std::pair<SurfaceId, Plane>> planes;
  for (const SurfaceId id : surfaces) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
    planes.emplace_back(
        id, geometry::fitted_plane(surface.moments(&map.noise), surface.reference(), surface.plane().normal));
  }
  return planes;
}

FoundPlanes LikelihoodDetector::detect_anew(const MapView& map, const occupancy::OccupancyMap& octree) const {
  FoundPlanes found{Readings(octree, map.window, map.noise), {}};
  found.planes = segment(found.readings, limits_of(map.parameters));
  return found;
}

std::map<VoxelKey, surfaces::Refusal> LikelihoodDetector::refusals(const MapView& map,
                                                                   const occupancy::OccupancyMap& octree,
                                                                   std::span<const VoxelKey> pending) const {
  const Readings readings(octree, map.window, neighbourhood_of(map, pending, {}), map.noise);
  std::vector<Refused> refused;
  const Segmentation found =
      segment(readings, limits_of(map.parameters), known_about(readings, map.surfaces, {}), &refused);
  std::map<VoxelKey, surfaces::Refusal> reasons;
  for (const Refused& plane : refused)
    for (const Readings::Index i : plane.readings) reasons[readings[i].key] = plane.why;
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (found.labels[i] != clutter) reasons[readings[i].key] = {Reason::waiting};
  return reasons;
}

}  // namespace octosurf::detection
