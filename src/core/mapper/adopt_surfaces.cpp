#include "mapper/adopt_surfaces.hpp"

#include "sensing/reading_model.hpp"

#include <map>

namespace octosurf::mapper {
namespace {

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

void adopt_surfaces(surfaces::Ledger& ledger, std::span<const occupancy::VoxelPoint> appeared,
                    const ForeignSurfaces& foreign) {
  std::map<SurfaceId, std::vector<PointId>> pending;  // by their surface in the other map
  for (std::size_t k = 0; k < appeared.size(); ++k)
    if (foreign.owner[k] != 0) pending[foreign.owner[k]].push_back(ledger.window.find(appeared[k].key));
  const sensing::ReadingModel model(ledger.noise, ledger.grid.resolution());
  const auto fewest = static_cast<std::size_t>(ledger.parameters.min_surface_points());
  for (auto& [owner, points] : pending) {
    const surfaces::SurfaceModel& theirs = *foreign.store.find(owner);
    const Plane plane = moved(theirs.plane(), foreign.T_map_other);
    // Where two of the other map's points fell into one voxel here, its point may be another surface's.
    std::erase_if(points, [&](PointId i) { return !model.belongs(ledger.window[i], plane); });
    if (points.size() < fewest) continue;
    surfaces::SurfaceModel& own = ledger.create(plane, ledger.window[points.front()].position.cast<double>());
    for (const PointId i : points) ledger.give(i, own);
    own.take_evidence(moved_evidence(theirs, foreign.T_map_other));
    ledger.changes.born.insert(own.id());
  }
}

}  // namespace octosurf::mapper
