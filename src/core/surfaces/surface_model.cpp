#include "surfaces/surface_model.hpp"

#include "geometry/rings.hpp"
#include "surfaces/intersections.hpp"

#include <cmath>
#include <numbers>

namespace octosurf::surfaces {

std::array<float, 3> color_of(SurfaceId id) {
  const double hue = 6 * std::fmod(static_cast<double>(id) * std::numbers::phi, 1.0);
  // Two levels of lightness separate neighbouring hues.
  const double value = id % 2 == 0 ? 0.95 : 0.75, saturation = 0.65;
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + hue, 6.0);
    return static_cast<float>(value - value * saturation * std::clamp(std::min(k, 4 - k), 0.0, 1.0));
  };
  return {channel(5), channel(3), channel(1)};
}

SurfaceModel::SurfaceModel(SurfaceId id, const Plane& plane, const Eigen::Vector3d& origin, double resolution)
    : PlaneEstimate(plane, origin), SurfaceOutline(pose(), resolution), id_(id) {}

SurfaceModel::SurfaceModel(const State& state, double resolution)
    : PlaneEstimate(state),
      SurfaceOutline(state.hash_frame, resolution),
      born(state.born),
      revision(state.revision),
      checked_size(state.checked_size),
      id_(state.id),
      parents_(state.parents) {
  for (const Inlier& inlier : state.inliers) insert(inlier);
  polygons_ = state.polygons;
  polygons_stale_ = state.polygons_stale;
}

SurfaceModel::State SurfaceModel::head() const {
  return {estimate_state(), id_,      hash_frame(), {},       {},
          polygons_stale_,  parents_, born,         revision, checked_size};
}

SurfaceModel::State SurfaceModel::state(const Snapshot* published) const {
  State state = head();
  state.inliers = sorted_inliers();
  state.polygons = published != nullptr ? published->find(id_)->polygons : polygons_;
  return state;
}

void SurfaceModel::add_parent(SurfaceId id) {
  constexpr std::size_t most = 1000;
  parents_.push_back(id);
  if (parents_.size() > most) parents_.erase(parents_.begin() + most / 2);
}

void SurfaceModel::add(const Inlier& inlier) {
  insert(inlier);
  PlaneEstimate::add(inlier.position, inlier.range_class);
}

bool SurfaceModel::remove(geometry::VoxelKey key, const Eigen::Vector3f& position) {
  const std::optional<Inlier> removed = take_out(key, position);
  if (removed) PlaneEstimate::remove(removed->position, removed->range_class);
  return removed.has_value();
}

void SurfaceModel::rehash_if_tilted() {
  if (hash_frame().linear().col(2).dot(plane().normal) <= cos_largest_tilt) rehash(pose());
}

Eigen::Affine2d SurfaceModel::T_surface_outline() const {
  const Eigen::Vector3d along = hash_frame().linear().col(2);
  const auto on_plane = [&](double u, double v) -> Eigen::Vector2d {
    const Eigen::Vector3d p = place_of({u, v});
    const Eigen::Vector3d q = p - plane().signed_distance(p) / plane().normal.dot(along) * along;
    return (pose().linear().transpose() * (q - pose().translation())).head<2>();
  };
  Eigen::Affine2d T = Eigen::Affine2d::Identity();
  T.translation() = on_plane(0, 0);
  T.linear().col(0) = on_plane(1, 0) - T.translation();
  T.linear().col(1) = on_plane(0, 1) - T.translation();
  return T;
}

OutlineChange SurfaceModel::take_outline_change(double max_hole_size, const SurfaceStore* others) {
  return take_change(
      id_, T_surface_outline(),
      others != nullptr ? find_intersections(*this, *others, max_hole_size) : IntersectionSites{});
}

void SurfaceModel::derive(double max_hole_size, const sensing::NoiseModel* noise,
                          const SurfaceStore* others) {
  update_raster(max_hole_size, noise);
  polygons_ = polygons_with(take_outline_change(max_hole_size, others));
}

SurfacePtr SurfaceModel::publish(std::uint64_t map_revision) const {
  auto surface = std::make_shared<Surface>();
  surface->id = id_;
  surface->resolution = resolution();
  surface->color = color_of(id_);
  surface->plane = plane();
  surface->T_map_surface = pose();
  geometry::set_polygons(*surface, polygons_);
  surface->inliers = size();
  surface->rms_m = rms();
  surface->covariance = covariance();
  surface->born = born;
  surface->revision = map_revision;
  surface->parents = parents_;
  return surface;
}

}  // namespace octosurf::surfaces
