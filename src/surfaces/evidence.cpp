#include "surfaces/evidence.hpp"

#include "occupancy/payload.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace octosurf {
namespace {

/// What a scan read over one cell of a surface.
struct CellReadings {
  SurfaceId surface;
  std::uint64_t cell;
  std::uint32_t points;  ///< voxels whose point is among them
  double count;
  Eigen::Vector3d sum;  ///< of `count` positions, about the surface's reference
};

class Observation {
 public:
  Observation(Workspace& work, const VoxelScan& scan) : work_(work), noise_(work.state.noise), scan_(scan) {}

  /// `owner`: of the reading's voxel, 0 if it has none.
  void add(const EndVoxel& end, SurfaceId owner, bool point) {
    SurfaceModel* surface = owner != 0 ? find(owner) : nearest(end);
    if (surface == nullptr || misfit(end, *surface) > 1) return;
    const PlaneCell cell = surface->cell_of(end.centroid);
    if (!surface->well_within_rim(cell)) return;
    readings_.push_back({surface->id(), cell.packed(), point ? 1U : 0U, static_cast<double>(end.count),
                         end.count * (end.centroid.cast<double>() - surface->reference())});
  }

  void hand_over() {
    std::stable_sort(readings_.begin(), readings_.end(), [](const CellReadings& a, const CellReadings& b) {
      return std::pair(a.surface, a.cell) < std::pair(b.surface, b.cell);
    });
    for (auto at = readings_.begin(); at != readings_.end();) {
      CellReadings all = *at;
      for (++at; at != readings_.end() && at->surface == all.surface && at->cell == all.cell; ++at) {
        all.points += at->points;
        all.count += at->count;
        all.sum += at->sum;
      }
      SurfaceModel& surface = *find(all.surface);
      const Eigen::Vector3d mean = surface.reference() + all.sum / all.count;
      surface.observe(mean.cast<float>(), weight(mean, all.count, surface), all.points);
    }
  }

 private:
  SurfaceModel* find(SurfaceId id) {  // they come in runs of one surface
    if (id != last_id_) last_ = work_.state.surfaces.find(last_id_ = id);
    return last_;
  }

  /// Share of the tolerance.
  double misfit(const EndVoxel& end, const SurfaceModel& surface) const {
    const Eigen::Vector3d sight = scan_.origin.cast<double>() - end.centroid.cast<double>();
    const double range = sight.norm();
    const unsigned range_class = range_class_of(static_cast<float>(range));
    return std::fabs(surface.distance(end.centroid)) /
           noise_.tolerance(range_class, surface.plane().normal.dot(sight) / range);
  }

  SurfaceModel* nearest(const EndVoxel& end) {
    SurfaceModel* best = nullptr;
    double least = 1;
    for (const SurfaceId id : work_.state.surfaces.near(end.key, 1)) {
      SurfaceModel& surface = *work_.state.surfaces.find(id);
      const double misfits = misfit(end, surface);
      if (misfits > least || !surface.within_rim(surface.cell_of(end.centroid))) continue;
      best = &surface;
      least = misfits;
    }
    return best;
  }

  /// That of an inlier of the nearest class is 1.
  double weight(const Eigen::Vector3d& mean, double count, const SurfaceModel& surface) const {
    constexpr double independent = 8;     // readings in a cell
    constexpr double least_facing = 0.1;  // the views' own errors turn what is seen more along the plane
    const Eigen::Vector3d sight = scan_.origin.cast<double>() - mean;
    const double range = sight.norm();
    const double facing = std::max(least_facing, surface.plane().normal.dot(sight) / range);
    const double ratio =
        noise_.sigma(1) / (noise_.spread(range_class_of(static_cast<float>(range))) * facing);
    return independent * count / (independent + count) * ratio * ratio;
  }

  Workspace& work_;
  const NoiseModel& noise_;
  const VoxelScan& scan_;
  std::vector<CellReadings> readings_;
  SurfaceId last_id_ = 0;
  SurfaceModel* last_ = nullptr;
};

}  // namespace

void observe(Workspace& work, const VoxelScan& scan, const OccupancyDelta& delta) {
  const VoxelGrid& grid = work.state.occupancy.grid();
  Observation observation(work, scan);
  std::vector<bool> hit(scan.ends.size(), false);
  for (const OccupancyDelta::Hit& h : delta.hits) {
    hit[h.end] = true;
    const EndVoxel& end = scan.ends[h.end];
    SurfaceId owner = h.surface;
    // This scan may have given its voxel to a surface, or merged or dissolved the one it belonged to.
    if (h.point || (owner != 0 && work.state.surfaces.find(owner) == nullptr)) {
      const PointWindow::Index i = work.window.find(end.key);
      owner = i == PointWindow::none ? 0 : work.window[i].surface;
    }
    observation.add(end, owner, h.point && owner != 0);
  }
  // Voxels that rays keep free although something is read in them now and then.
  std::vector<std::uint32_t> others;
  for (std::uint32_t e = 0; e < scan.ends.size(); ++e)
    if (!hit[e] && scan.within_range(grid.centre_of(scan.ends[e].key))) others.push_back(e);
  std::sort(others.begin(), others.end(),
            [&](std::uint32_t a, std::uint32_t b) { return scan.ends[a].key < scan.ends[b].key; });
  for (const std::uint32_t e : others) observation.add(scan.ends[e], 0, false);
  observation.hand_over();
}

}  // namespace octosurf
