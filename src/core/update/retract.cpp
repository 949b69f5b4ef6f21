#include "update/retract.hpp"

#include "sensing/reading_code.hpp"
#include "sensing/reading_model.hpp"

#include <algorithm>

namespace octosurf::update {

void retract(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta) {
  const sensing::ReadingModel model(ledger.noise, ledger.grid.resolution());
  for (const occupancy::VoxelPoint& p : delta.vanished) {
    if (p.surface == 0) continue;
    ledger.drop(p);
  }
  for (const occupancy::OccupancyDelta::Refined& r : delta.refined) {
    if (r.before.surface == 0) {
      ledger.changes.unprocessed.push_back(r.after.key);  // seen better, it may fit a plane now
      continue;
    }
    surfaces::SurfaceModel* surface = ledger.find(r.before.surface);
    if (surface == nullptr) continue;
    const PointId i = ledger.window.find(r.after.key);
    if (model.belongs(r.after, surface->plane()))
      ledger.move(i, r.before.position);
    else
      ledger.requeue(i, r.before.position);
  }
  for (const SurfaceId id : ledger.changes.touched())
    if (surfaces::SurfaceModel& surface = *ledger.find(id); ledger.too_small(surface))
      ledger.dissolve(surface);
}

void observe_again(surfaces::Ledger& ledger, const sensing::VoxelScan& scan,
                   std::span<const occupancy::OccupancyDelta::Confirmed> confirmed) {
  constexpr double independent = 8;  // readings in a voxel with independent errors
  constexpr double least_cos_incidence = 0.1;
  constexpr std::size_t large_surface = 2000;  // inliers; every eighth reading suffices for its plane
  const sensing::NoiseModel& noise = ledger.noise;
  const sensing::ReadingModel model(noise, ledger.grid.resolution());
  surfaces::SurfaceModel* surface = nullptr;  // cached: readings come in runs of one surface
  SurfaceId found = 0;
  for (const occupancy::OccupancyDelta::Confirmed& c : confirmed) {
    if (c.surface != found) surface = ledger.find(found = c.surface);
    if (surface == nullptr || (surface->size() > large_surface && c.end % 8 != 0)) continue;
    const sensing::EndVoxel& end = scan.ends[c.end];
    const Eigen::Vector3d sight = scan.start_of(end).cast<double>() - end.centroid.cast<double>();
    const double range = sight.norm();
    const double cos_incidence = std::max(least_cos_incidence, surface->plane().normal.dot(sight) / range);
    const unsigned range_class = sensing::range_class_of(static_cast<float>(range));
    if (!(model.log_ratio(surface->distance(end.centroid), range_class, cos_incidence) > 0)) continue;
    if (!surface->surrounded(surface->cell_of(end.centroid))) continue;
    const double n = independent * end.count / (independent + end.count);
    const double ratio = noise.sigma(1) / (noise.measured_sigma(range_class) * cos_incidence);
    surface->observe(end.centroid, n * ratio * ratio);
  }
}

}  // namespace octosurf::update
