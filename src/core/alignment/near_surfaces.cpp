#include "alignment/near_surfaces.hpp"

#include "surfaces/map_state.hpp"

#include <utility>

namespace octosurf::alignment {
namespace {

/// `model`: of the map under construction, whose published surfaces have no polygons yet; else null.
Eigen::AlignedBox3d box_of(const Surface& surface, const surfaces::SurfaceModel* model) {
  Eigen::AlignedBox3d box;
  if (model == nullptr)
    for (const Eigen::Vector3d& vertex : surface.boundary) box.extend(vertex);
  else
    model->raster().for_each_tile([&](const geometry::CellBits::Cells& cells) {
      const Eigen::AlignedBox2d part = cells.box();
      for (int i = 0; i < 4; ++i)
        box.extend(model->place_of(part.corner(static_cast<Eigen::AlignedBox2d::CornerType>(i))));
    });
  return box;
}

struct AreaMoments {
  double area = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();  ///< mean of (p − centre)(p − centre)ᵀ
};

/// By Green's theorem, ring by ring: holes have the opposite orientation and count negative.
AreaMoments area_moments(const std::vector<Polygon>& polygons) {
  AreaMoments m;
  const auto add = [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      const double twice = a.x() * b.y() - b.x() * a.y();
      m.area += twice / 2;
      m.centre += twice / 6 * (a + b);
      const Eigen::Vector2d c = a + b;
      m.scatter += twice / 24 * (a * a.transpose() + b * b.transpose() + c * c.transpose());
    }
  };
  for (const Polygon& polygon : polygons) {
    add(polygon.outer);
    for (const Ring2& hole : polygon.holes) add(hole);
  }
  if (!(m.area > 0)) return {};
  m.centre /= m.area;
  m.scatter = m.scatter / m.area - m.centre * m.centre.transpose();
  return m;
}

/// An inlier stands for its cell, so the inliers' moments are those of the area, of which only the boundary's
/// course is coarser.
AreaMoments area_moments(const surfaces::SurfaceModel& model, const Eigen::Isometry3d& T_surface_map) {
  const geometry::Moments inliers = model.moments(nullptr);
  const Eigen::Matrix<double, 2, 3> axes = T_surface_map.linear().topRows<2>();
  return {inliers.count, (T_surface_map * (model.reference() + inliers.mean())).head<2>(),
          axes * inliers.covariance() * axes.transpose()};
}

/// Projection of a box of the map onto a surface's plane.
Eigen::AlignedBox2d in_plane(const Eigen::AlignedBox3d& box, const Eigen::Isometry3d& T_surface_map) {
  Eigen::AlignedBox2d covered;
  for (int corner = 0; corner < 8; ++corner)
    covered.extend(
        (T_surface_map * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))).head<2>());
  return covered;
}

/// Mean error of the outermost row of a surface's voxels, as a share of the voxel's edge: mixed readings at
/// an edge average both its sides.
constexpr double boundary_bias = 1.0 / 6;

/// Effect of a bias of boundary_bias · d in a strip d wide along one side of a surface on its plane. With s²
/// the variance of its area along an axis (w²/3 of a rectangle that is 2 w wide, of which the strip is d / 2
/// w): the slope is off by about boundary_bias · d² / s², the offset in the middle by boundary_bias · d² / s.
Eigen::Matrix3d boundary_covariance(const AreaMoments& m, double d) {
  const Eigen::Matrix2d scatter = m.scatter + d * d * Eigen::Matrix2d::Identity();  // at least a voxel wide
  const Eigen::Matrix2d inverse = scatter.inverse();
  const double bias = boundary_bias * d * d;
  Eigen::Matrix3d at_centre = Eigen::Matrix3d::Zero();
  at_centre.topLeftCorner<2, 2>() = bias * bias * inverse * inverse;
  at_centre(2, 2) = bias * bias * inverse.trace();
  Eigen::Matrix3d to_origin =
      Eigen::Matrix3d::Identity();  // off = c + a u + b v: at the centre c is smaller by the slopes' part
  to_origin.row(2).head<2>() = -m.centre.transpose();
  return to_origin * at_centre * to_origin.transpose();
}

}  // namespace

AlignedSurface::AlignedSurface(const Surface& surface, const surfaces::SurfaceModel* model,
                               double max_hole_size, double edge, const Eigen::AlignedBox2d& window)
    : plane(surface.plane),
      T_surface_map(surface.T_map_surface.inverse()),
      by_boundary(boundary_covariance(
          model != nullptr ? area_moments(*model, T_surface_map) : area_moments(surface.polygons),
          surface.resolution)),
      covariance(surface.covariance + by_boundary),
      raster(model != nullptr ? PlaneRaster(*model, T_surface_map, max_hole_size, edge, window)
                              : PlaneRaster(surface.polygons, edge, window)) {}

void NearSurfaces::follow(const Snapshot& snapshot, const surfaces::MapState* growing) {
  std::vector<Entry> entries;
  entries.reserve(snapshot.surfaces.size());
  auto before = entries_.begin();
  for (const SurfacePtr& surface : snapshot.surfaces) {
    while (before != entries_.end() && before->surface->id < surface->id) ++before;
    if (before != entries_.end() && before->surface == surface)
      entries.push_back(std::move(*before++));
    else
      entries.push_back(
          {surface, box_of(*surface, growing ? growing->surfaces.find(surface->id) : nullptr), nullptr});
  }
  entries_ = std::move(entries);
}

std::vector<const AlignedSurface*> NearSurfaces::in(const Snapshot& snapshot, const Eigen::AlignedBox3d& box,
                                                    const surfaces::MapState* growing) {
  follow(snapshot, growing);
  // Two voxels: fine enough for a stair's tread after erosion, coarse enough to be rebuilt for every surface
  // that a scan changes.
  const double edge = 2 * snapshot.resolution;
  std::vector<const AlignedSurface*> near;
  for (Entry& entry : entries_) {
    if (!entry.box.intersects(box)) continue;
    // When several scans are mapped together, one may have removed a surface that is still published.
    const surfaces::SurfaceModel* model =
        growing != nullptr ? growing->surfaces.find(entry.surface->id) : nullptr;
    if (growing != nullptr && model == nullptr) continue;
    const Eigen::AlignedBox2d window = in_plane(box, entry.surface->T_map_surface.inverse());
    if (!entry.aligned || !entry.aligned->raster.holds(window)) {
      const Eigen::Vector2d beyond = window.sizes() / 2;  // margin for the next scans
      entry.aligned = std::make_unique<AlignedSurface>(
          *entry.surface, model, growing != nullptr ? growing->parameters.max_hole_size() : 0, edge,
          Eigen::AlignedBox2d(window.min() - beyond, window.max() + beyond));
    }
    // Recomputed for every scan, because the noise estimate changes, too.
    if (model != nullptr)
      entry.aligned->covariance = model->covariance_of_readings(growing->noise) + entry.aligned->by_boundary;
    near.push_back(entry.aligned.get());
  }
  return near;
}

}  // namespace octosurf::alignment
