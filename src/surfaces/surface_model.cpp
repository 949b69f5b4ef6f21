#include "surfaces/surface_model.hpp"

#include "surfaces/alpha_shape.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf {

Eigen::Matrix3d plane_axes(const Eigen::Vector3d& normal) {
  Eigen::Matrix3d axes;
  axes.col(2) = normal;
  // All of a level plane's directions are horizontal: its x is then the one nearest the map's.
  const bool level = std::hypot(normal.x(), normal.y()) < 1e-6;
  axes.col(0) = level ? Eigen::Vector3d(Eigen::Vector3d::UnitY().cross(normal).normalized())
                      : Eigen::Vector3d(Eigen::Vector3d::UnitZ().cross(normal).normalized());
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

std::array<float, 3> color_of(SurfaceId id) {
  const double hue = 6 * std::fmod(id * std::numbers::phi, 1.0);
  // Two rings of lightness keep neighbours in hue apart as well.
  const double value = id % 2 == 0 ? 0.95 : 0.75, saturation = 0.65;
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + hue, 6.0);
    return static_cast<float>(value - value * saturation * std::clamp(std::min(k, 4 - k), 0.0, 1.0));
  };
  return {channel(5), channel(3), channel(1)};
}

SurfaceModel::SurfaceModel(SurfaceId id, const Plane& plane, const Eigen::Vector3d& origin, double resolution)
    : checked_plane(plane), id_(id), resolution_(resolution), plane_(plane), reference_(origin) {
  pose_.linear() = plane_axes(plane.normal);
  pose_.translation() = origin - plane.signed_distance(origin) * plane.normal;
  hash_frame_ = pose_;
  hash_axes_ = (hash_frame_.linear().leftCols<2>().transpose() / resolution_).cast<float>();
  hash_origin_ = hash_frame_.translation();
}

PlaneCell SurfaceModel::cell_of(const Eigen::Vector3f& p) const {
  const Eigen::Vector2f uv = hash_axes_ * (p.cast<double>() - hash_origin_).cast<float>();
  return {static_cast<std::int32_t>(std::floor(uv.x())), static_cast<std::int32_t>(std::floor(uv.y()))};
}

bool SurfaceModel::surrounded(PlaneCell cell) const {
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u)
      if ((u != 0 || v != 0) && !occupied({cell.u + u, cell.v + v})) return false;
  return true;
}

bool SurfaceModel::covers(PlaneCell cell) const {
  if (occupied(cell)) return true;
  int neighbours = 0;
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u) neighbours += occupied({cell.u + u, cell.v + v});
  return neighbours >= 5;
}

bool SurfaceModel::near(PlaneCell cell, int reach) const {
  for (int ring = 0; ring <= reach; ++ring)
    for (int v = -ring; v <= ring; ++v)
      for (int u = -ring; u <= ring; u += (std::abs(v) == ring ? 1 : 2 * ring))
        if (occupied({cell.u + u, cell.v + v})) return true;
  return false;
}

void SurfaceModel::insert(const Inlier& inlier) {
  const PlaneCell cell = cell_of(inlier.position);
  cells_.try_emplace(cell.packed()).first.value().push_back(inlier);
  // A point inside the boundary does not move it (paper III-B).
  if (!polygons_stale_ && !surrounded(cell)) polygons_stale_ = true;
  ++size_;
}

void SurfaceModel::add(const Inlier& inlier) {
  insert(inlier);
  ++unchecked;
  moments_[inlier.range_class].add(inlier.position.cast<double>() - reference_);
}

bool SurfaceModel::remove(VoxelKey key, const Eigen::Vector3f& position) {
  const PlaneCell at = cell_of(position);
  const auto entry = cells_.find(at.packed());
  if (entry == cells_.end()) return false;
  Cell& cell = entry.value();
  const auto found = std::find_if(cell.begin(), cell.end(), [&](const Inlier& i) { return i.key == key; });
  if (found == cell.end()) return false;
  moments_[found->range_class].add(found->position.cast<double>() - reference_, -1);
  cell.erase(found);
  --size_;
  ++unchecked;
  if (cell.empty()) cells_.erase(entry);
  if (!polygons_stale_ && (!occupied(at) || !surrounded(at))) polygons_stale_ = true;
  return true;
}

std::vector<Inlier> SurfaceModel::sorted_inliers() const {
  std::vector<Inlier> all;
  all.reserve(size_);
  for_each_inlier([&](const Inlier& inlier) { all.push_back(inlier); });
  std::sort(all.begin(), all.end(), [](const Inlier& a, const Inlier& b) { return a.key < b.key; });
  return all;
}

Moments SurfaceModel::moments(const NoiseModel* noise) const {
  Moments sum;
  for (unsigned c = 0; c < NoiseModel::classes; ++c) {
    if (moments_[c].count <= 0) continue;
    // Relative weights: the nearest class counts 1.
    const double ratio = noise != nullptr ? noise->sigma(1) / std::max(noise->sigma(c), 1e-6) : 1;
    sum.add(moments_[c], ratio * ratio);
  }
  return sum;
}

double SurfaceModel::rms() const {
  return std::sqrt(
      moments(nullptr).mean_squared_distance(plane_.normal, plane_.offset - plane_.normal.dot(reference_)));
}

void SurfaceModel::set_plane(const Plane& plane) {
  pose_.linear() =
      (Eigen::Quaterniond::FromTwoVectors(plane_.normal, plane.normal) * Eigen::Quaterniond(pose_.linear()))
          .normalized()
          .toRotationMatrix();
  pose_.linear().col(2) = plane.normal;
  pose_.linear().col(0) = pose_.linear().col(1).cross(plane.normal).normalized();
  pose_.linear().col(1) = plane.normal.cross(pose_.linear().col(0));
  plane_ = plane;
  pose_.translation() -= plane.signed_distance(pose_.translation()) * plane.normal;
}

void SurfaceModel::rehash_if_tilted() {
  constexpr double cos_1_deg = 0.99984769515639;
  if (hash_frame_.linear().col(2).dot(plane_.normal) > cos_1_deg) return;
  hash_frame_ = pose_;
  hash_axes_ = (hash_frame_.linear().leftCols<2>().transpose() / resolution_).cast<float>();
  hash_origin_ = hash_frame_.translation();
  const std::vector<Inlier> all = sorted_inliers();
  cells_.clear();
  size_ = 0;
  for (const Inlier& inlier : all) insert(inlier);
  polygons_stale_ = true;
}

std::vector<Eigen::Vector2d> SurfaceModel::outline_points(double max_hole_size) const {
  const Eigen::Isometry3d T_surface_map = pose_.inverse();
  std::vector<Inlier> rim;
  std::vector<PlaneCell> interior;
  if (max_hole_size >= 4 * resolution_) {
    const CellRaster raster = rasterize();
    for (const auto& [packed, cell] : cells_) {
      const PlaneCell at = PlaneCell::unpack(packed);
      if (!raster.deep_inside(at))
        rim.insert(rim.end(), cell.begin(), cell.end());
      else if (at.u % 2 == 0 && at.v % 2 == 0)
        interior.push_back(at);
    }
    std::sort(rim.begin(), rim.end(), [](const Inlier& a, const Inlier& b) { return a.key < b.key; });
    std::sort(interior.begin(), interior.end(),
              [](PlaneCell a, PlaneCell b) { return std::pair(a.v, a.u) < std::pair(b.v, b.u); });
  } else {
    rim = sorted_inliers();
  }
  std::vector<Eigen::Vector2d> points;
  points.reserve(rim.size() + interior.size());
  for (const Inlier& inlier : rim)
    points.push_back((T_surface_map * inlier.position.cast<double>()).head<2>());
  const Eigen::Isometry3d T_surface_hash = T_surface_map * hash_frame_;
  for (const PlaneCell cell : interior)
    points.push_back(
        (T_surface_hash * Eigen::Vector3d((cell.u + 0.5) * resolution_, (cell.v + 0.5) * resolution_, 0))
            .head<2>());
  return points;
}

SurfaceModel::CellRaster SurfaceModel::rasterize() const {
  CellRaster raster;
  PlaneCell low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};
  for (const auto& entry : cells_) {
    const PlaneCell at = PlaneCell::unpack(entry.first);
    low = {std::min(low.u, at.u), std::min(low.v, at.v)};
    high = {std::max(high.u, at.u), std::max(high.v, at.v)};
  }
  constexpr std::int64_t largest = std::int64_t{1} << 26;  // cells, a byte each
  const std::int64_t width = std::int64_t{high.u} - low.u + 1, height = std::int64_t{high.v} - low.v + 1;
  if (cells_.empty() || width * height > largest) return raster;
  raster.low = low;
  raster.width = static_cast<std::int32_t>(width);
  raster.height = static_cast<std::int32_t>(height);
  raster.cells.assign(static_cast<std::size_t>(width * height), 0);
  for (const auto& entry : cells_) {
    const PlaneCell at = PlaneCell::unpack(entry.first);
    raster.cells[static_cast<std::size_t>((at.v - low.v) * width + (at.u - low.u))] = 1;
  }
  return raster;
}

bool SurfaceModel::CellRaster::deep_inside(PlaneCell cell) const {
  const std::int32_t u = cell.u - low.u, v = cell.v - low.v;
  if (cells.empty() || u < 2 || v < 2 || u >= width - 2 || v >= height - 2) return false;
  for (std::int64_t y = v - 2; y <= v + 2; ++y)
    for (std::int64_t x = u - 2; x <= u + 2; ++x)
      if (cells[static_cast<std::size_t>(y * width + x)] == 0) return false;
  return true;
}

void SurfaceModel::derive(double max_hole_size) {
  polygons_ = alpha_shape(outline_points(max_hole_size), max_hole_size);
  simplified_ = simplify(polygons_, resolution_ / 2);
  polygons_stale_ = false;
}

SurfacePtr SurfaceModel::publish(std::uint64_t map_revision) const {
  auto surface = std::make_shared<Surface>();
  surface->id = id_;
  surface->color = color_of(id_);
  surface->plane = plane_;
  surface->T_map_surface = pose_;
  surface->polygons = polygons_;
  surface->simplified = simplified_;
  for (const Polygon& polygon : polygons_) {
    for (const Eigen::Vector2d& p : polygon.outer) surface->boundary.push_back(surface->to_map(p));
    for (const Ring2& hole : polygon.holes)
      for (const Eigen::Vector2d& p : hole) surface->boundary.push_back(surface->to_map(p));
    surface->area_m2 += area_of(polygon);
  }
  surface->inliers = size_;
  surface->rms_m = rms();
  surface->revision = map_revision;
  surface->parents = parents_;
  return surface;
}

SurfaceModel::State SurfaceModel::state() const {
  return {id_,        plane_,          checked_plane,    pose_,     hash_frame_,
          reference_, moments_,        sorted_inliers(), polygons_, simplified_,
          parents_,   polygons_stale_, revision,         unchecked};
}

SurfaceModel::SurfaceModel(const State& state, double resolution)
    : SurfaceModel(state.id, state.plane, state.reference, resolution) {
  checked_plane = state.checked_plane;
  revision = state.revision;
  unchecked = state.unchecked;
  pose_ = state.pose;
  hash_frame_ = state.hash_frame;
  hash_axes_ = (hash_frame_.linear().leftCols<2>().transpose() / resolution_).cast<float>();
  hash_origin_ = hash_frame_.translation();
  for (const Inlier& inlier : state.inliers) insert(inlier);
  moments_ = state.moments;
  parents_ = state.parents;
  polygons_ = state.polygons;
  simplified_ = state.simplified;
  polygons_stale_ = state.polygons_stale;
}

}  // namespace octosurf
