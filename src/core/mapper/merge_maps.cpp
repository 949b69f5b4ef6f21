#include "mapper/merge_maps.hpp"

#include "sensing/reading_model.hpp"

#include <map>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::mapper {
namespace {

void require_same(const char* parameter, double ours, double theirs, const char* hint) {
  if (ours == theirs) return;
  throw Error(Error::Kind::data, "the other map",
              std::string("its ") + parameter + " is " + std::to_string(theirs) + ", here it is " +
                  std::to_string(ours),
              hint);
}

Plane moved(const Plane& plane, const Eigen::Isometry3d& T) {
  const Eigen::Vector3d normal = (T.linear() * plane.normal).normalized();
  return {normal, plane.offset + normal.dot(T.translation())};
}

/// A surface's evidence from later scans, transformed to this map's frame.
surfaces::PlaneEstimate moved_evidence(const surfaces::PlaneEstimate& surface, const Eigen::Isometry3d& T) {
  const Eigen::Matrix3d R = T.linear();
  surfaces::PlaneEstimate::State state;
  state.reference = T * surface.reference();
  state.evidence = surface.evidence();
  state.evidence.moments.sum = R * state.evidence.moments.sum;
  state.evidence.moments.outer = R * state.evidence.moments.outer * R.transpose();
  return surfaces::PlaneEstimate(state);
}

}  // namespace

void require_mergeable(const surfaces::MapState& map, const surfaces::MapState& other,
                       const Eigen::Isometry3d& T_map_other) {
  if (&map == &other)
    throw Error(Error::Kind::usage, "the other map", "is the map itself, whose readings would count twice",
                "give another one");
  require_rigid(T_map_other, "T_map_other");
  const OccupancyParameters &ours = map.parameters.occupancy, &theirs = other.parameters.occupancy;
  constexpr const char* hint = "build one of them anew with the other's parameters";
  require_same("resolution", ours.resolution, theirs.resolution, hint);
  // The weights of hits and misses may differ, as they are already in the log-odds. These parameters define
  // what log-odds mean.
  require_same("clamp_min", ours.clamp_min, theirs.clamp_min, hint);
  require_same("clamp_max", ours.clamp_max, theirs.clamp_max, hint);
  require_same("occupied", ours.occupied, theirs.occupied, hint);
}

void add_records(surfaces::MapState& map, const surfaces::MapState& other,
                 const Eigen::Isometry3d& T_map_other) {
  map.scans += other.scans;
  map.held.insert(map.held.end(), other.held.begin(), other.held.end());
  map.sensors_up += T_map_other.linear() * other.sensors_up;
  map.noise.add(other.noise);
}

void adopt_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap::Merged& merged,
                    const surfaces::SurfaceStore& others, const Eigen::Isometry3d& T_map_other) {
  std::map<SurfaceId, std::vector<PointId>> pending;  // by their surface in the other map
  for (std::size_t k = 0; k < merged.surfaces.size(); ++k)
    if (const SurfaceId owner = merged.surfaces[k]; owner != 0)
      pending[owner].push_back(ledger.window.find(merged.delta.appeared[k].key));
  const sensing::ReadingModel model(ledger.noise, ledger.grid.resolution());
  const auto fewest = static_cast<std::size_t>(ledger.parameters.min_surface_points());
  for (auto& [owner, points] : pending) {
    const surfaces::SurfaceModel& theirs = *others.find(owner);
    const Plane plane = moved(theirs.plane(), T_map_other);
    // Where two of the other map's points fell into one voxel here, its point may be another surface's.
    std::erase_if(points, [&](PointId i) { return !model.belongs(ledger.window[i], plane); });
    if (points.size() < fewest) continue;
    surfaces::SurfaceModel& own = ledger.create(plane, ledger.window[points.front()].position.cast<double>());
    for (const PointId i : points) ledger.give(i, own);
    own.take_evidence(moved_evidence(theirs, T_map_other));
    ledger.changes.born.insert(own.id());
  }
}

}  // namespace octosurf::mapper
