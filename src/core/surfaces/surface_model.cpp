#include "surfaces/surface_model.hpp"

#include "geometry/plane_covariance.hpp"
#include "geometry/rings.hpp"
#include "geometry/symmetric.hpp"
#include "surfaces/reading_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::surfaces {
namespace {

/// Squared systematic offset of the inliers' points from the plane along its normal, beyond their random
/// error: rays free the voxels before a plane, not those behind it, and a voxel behind that noise reached
/// once counts as much as one that each scan hits. Repeated observations are weighted by their number, so the
/// difference of the two reveals it.
double offset_bias(const geometry::ReadingGroup& inliers, const geometry::ReadingGroup& repeated,
                   const Eigen::Vector3d& normal) {
  if (!(inliers.about.count > 0 && repeated.about.count > 0)) return 0;
  double chance = 0;
  for (const geometry::ReadingGroup* group : {&inliers, &repeated})
    chance += normal.dot(group->about.covariance() * normal) / std::max(1.0, group->readings);
  const double difference = normal.dot(inliers.about.mean() - repeated.about.mean());
  const double share = inliers.about.count / (inliers.about.count + repeated.about.count);
  return share * share * std::max(0.0, difference * difference - chance);
}

/// The inliers' own points and the repeated observations, about the origin of the surface's frame.
std::array<geometry::ReadingGroup, 2> reading_groups(const SurfaceModel& surface,
                                                     const sensing::NoiseModel& noise) {
  const Eigen::Vector3d origin = surface.pose().translation() - surface.reference();
  const SurfaceModel::Evidence& repeated = surface.evidence();
  geometry::Moments kept = surface.moments(&noise);
  kept.add(repeated.moments, -1);
  return {{{kept.shifted(origin), static_cast<double>(surface.size())},
           {repeated.moments.shifted(origin), repeated.readings}}};
}

}  // namespace

std::array<float, 3> color_of(SurfaceId id) {
  const double hue = 6 * std::fmod(id * std::numbers::phi, 1.0);
  // Two levels of lightness separate neighbouring hues.
  const double value = id % 2 == 0 ? 0.95 : 0.75, saturation = 0.65;
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + hue, 6.0);
    return static_cast<float>(value - value * saturation * std::clamp(std::min(k, 4 - k), 0.0, 1.0));
  };
  return {channel(5), channel(3), channel(1)};
}

SurfaceModel::SurfaceModel(SurfaceId id, const Plane& plane, const Eigen::Vector3d& origin, double resolution,
                           memory::PageFile* file)
    : id_(id), resolution_(resolution), file_(file), plane_(plane), reference_(origin) {
  pose_.linear() = geometry::plane_axes(plane.normal);
  pose_.translation() = origin - plane.signed_distance(origin) * plane.normal;
  set_hash_frame(pose_);
  edge_bleed_.fill(resolution);
}

void SurfaceModel::set_hash_frame(const Eigen::Isometry3d& frame) {
  hash_frame_ = frame;
  hash_axes_ = (hash_frame_.linear().leftCols<2>().transpose() / resolution_).cast<float>();
  hash_origin_ = hash_frame_.translation();
}

geometry::PlaneCell SurfaceModel::cell_of(const Eigen::Vector3f& p) const {
  const Eigen::Vector2f uv = hash_axes_ * (p.cast<double>() - hash_origin_).cast<float>();
  return {static_cast<std::int32_t>(std::floor(uv.x())), static_cast<std::int32_t>(std::floor(uv.y()))};
}

bool SurfaceModel::surrounded(geometry::PlaneCell cell) const {
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u)
      if ((u != 0 || v != 0) && !occupied({cell.u + u, cell.v + v})) return false;
  return true;
}

bool SurfaceModel::covers(geometry::PlaneCell cell) const {
  if (occupied(cell)) return true;
  int neighbours = 0;
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u) neighbours += occupied({cell.u + u, cell.v + v});
  return neighbours >= 5;
}

std::optional<geometry::PlaneCell> SurfaceModel::nearest(geometry::PlaneCell cell, int reach) const {
  return geometry::first_in_rings(cell, 0, reach, [this](geometry::PlaneCell at) { return occupied(at); });
}

Eigen::Vector3d SurfaceModel::place_of(const Eigen::Vector2d& uv) const {
  return hash_frame_ * Eigen::Vector3d(uv.x() * resolution_, uv.y() * resolution_, 0);
}

Eigen::Affine2d SurfaceModel::T_frame_cells(const Eigen::Isometry3d& T_frame_map) const {
  const Eigen::Isometry3d T = T_frame_map * hash_frame_;
  Eigen::Affine2d result = Eigen::Affine2d::Identity();
  result.linear() = resolution_ * T.linear().topLeftCorner<2, 2>();
  result.translation() = T.translation().head<2>();
  return result;
}

void SurfaceModel::insert(const Inlier& inlier) {
  const geometry::PlaneCell cell = cell_of(inlier.position);
  inliers_.add(cell, inlier);
  // A point deep inside the boundary does not change it (paper III-B).
  if (bits_.change(cell, true)) polygons_stale_ = true;
  ++size_;
}

void SurfaceModel::add(const Inlier& inlier) {
  insert(inlier);
  moments_[inlier.range_class].add(inlier.position.cast<double>() - reference_);
}

bool SurfaceModel::remove(geometry::VoxelKey key, const Eigen::Vector3f& position) {
  const geometry::PlaneCell at = cell_of(position);
  const std::optional<InlierTiles::Removed> removed = inliers_.remove(at, key);
  if (!removed) return false;
  const Inlier& inlier = removed->inlier;
  moments_[inlier.range_class].add(inlier.position.cast<double>() - reference_, -1);
  // The inlier's part of the evidence is unknown, so an average share is removed.
  fade(1 - 1 / static_cast<double>(size_));
  --size_;
  if (bits_.change(at, !removed->cell_empty)) polygons_stale_ = true;
  return true;
}

std::vector<Inlier> SurfaceModel::sorted_inliers() const {
  std::vector<Inlier> all;
  all.reserve(size_);
  for_each_inlier([&](const Inlier& inlier) { all.push_back(inlier); });
  std::sort(all.begin(), all.end(), [](const Inlier& a, const Inlier& b) { return a.key < b.key; });
  return all;
}

geometry::Moments SurfaceModel::moments(const sensing::NoiseModel* noise) const {
  geometry::Moments sum;
  for (unsigned c = 0; c < sensing::NoiseModel::classes; ++c) {
    if (moments_[c].count <= 0) continue;
    // Weighted as the evidence: by the measured noise relative to the nearest class's allowed noise.
    const double ratio = noise != nullptr ? noise->sigma(1) / std::max(noise->measured_sigma(c), 1e-6) : 1;
    sum.add(moments_[c], ratio * ratio);
  }
  if (noise != nullptr) sum.add(evidence_.moments);
  return sum;
}

Plane SurfaceModel::estimate(const sensing::NoiseModel& noise) const {
  return geometry::fitted_plane(moments(&noise), reference_, plane_.normal);
}

void SurfaceModel::observe(const Eigen::Vector3f& position, double weight) {
  constexpr double max_readings = 100;  // per inlier
  evidence_.moments.add(position.cast<double>() - reference_, weight);
  if (++evidence_.readings > max_readings * static_cast<double>(size_)) fade(0.5);
}

void SurfaceModel::take_evidence(const SurfaceModel& other) {
  evidence_.moments.add(other.evidence_.moments.shifted(reference_ - other.reference_));
  evidence_.readings += other.evidence_.readings;
}

void SurfaceModel::fade(double share) {
  geometry::Moments faded;
  faded.add(evidence_.moments, share);
  evidence_.moments = faded;
  evidence_.readings *= share;
}

double SurfaceModel::rms() const {
  return std::sqrt(
      moments(nullptr).mean_squared_distance(plane_.normal, plane_.offset - plane_.normal.dot(reference_)));
}

void SurfaceModel::set_plane(const Plane& plane) {
  pose_.linear() =
      (geometry::rotation_between(plane_.normal, plane.normal) * Eigen::Quaterniond(pose_.linear()))
          .normalized()
          .toRotationMatrix();
  pose_.linear().col(2) = plane.normal;
  pose_.linear().col(0) = pose_.linear().col(1).cross(plane.normal).normalized();
  pose_.linear().col(1) = plane.normal.cross(pose_.linear().col(0));
  plane_ = plane;
  pose_.translation() -= plane.signed_distance(pose_.translation()) * plane.normal;
}

void SurfaceModel::rehash_if_tilted() {
  if (hash_frame_.linear().col(2).dot(plane_.normal) > cos_largest_tilt) return;
  set_hash_frame(pose_);
  const std::vector<Inlier> all = sorted_inliers();
  inliers_.clear();
  bits_.clear();
  outline_.reset();
  intersections_.clear();
  size_ = 0;
  for (const Inlier& inlier : all) insert(inlier);
  polygons_stale_ = true;
}

Eigen::Matrix3d covariance_of_readings(const SurfaceModel& surface, const sensing::NoiseModel& noise) {
  const Eigen::Matrix3d c =
      geometry::covariance_over(reading_groups(surface, noise), surface.pose().linear().transpose());
  constexpr std::array<int, 3> order{1, 2, 0};  // slopes first
  Eigen::Matrix3d covariance;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      covariance(row, column) = (c(order[row], order[column]) + c(order[column], order[row])) / 2;
  return covariance;
}

void SurfaceModel::derive_covariance(const sensing::NoiseModel& noise) {
  covariance_ = covariance_of_readings(*this, noise);
  const std::array<geometry::ReadingGroup, 2> groups = reading_groups(*this, noise);
  covariance_(2, 2) += offset_bias(groups[0], groups[1], plane_.normal);
}

SurfacePtr SurfaceModel::publish(std::uint64_t map_revision) const {
  auto surface = std::make_shared<Surface>();
  surface->id = id_;
  surface->resolution = resolution_;
  surface->color = color_of(id_);
  surface->plane = plane_;
  surface->T_map_surface = pose_;
  geometry::set_polygons(*surface, polygons_);
  surface->inliers = size_;
  surface->rms_m = rms();
  surface->covariance = covariance_;
  surface->born = born;
  surface->revision = map_revision;
  surface->parents = parents_;
  return surface;
}

SurfaceModel::State SurfaceModel::head() const {
  return {id_, plane_, pose_,    hash_frame_,     reference_, moments_, evidence_,   covariance_,
          {},  {},     parents_, polygons_stale_, born,       revision, checked_size};
}

SurfaceModel::State SurfaceModel::state(const Snapshot* published) const {
  State state = head();
  state.inliers = sorted_inliers();
  state.polygons = published != nullptr ? published->find(id_)->polygons : polygons_;
  return state;
}

SurfaceModel::SurfaceModel(const State& state, double resolution, memory::PageFile* file)
    : SurfaceModel(state.id, state.plane, state.reference, resolution, file) {
  born = state.born;
  revision = state.revision;
  checked_size = state.checked_size;
  pose_ = state.pose;
  set_hash_frame(state.hash_frame);
  for (const Inlier& inlier : state.inliers) insert(inlier);
  moments_ = state.moments;
  evidence_ = state.evidence;
  covariance_ = state.covariance;
  parents_ = state.parents;
  polygons_ = state.polygons;
  polygons_stale_ = state.polygons_stale;
}

}  // namespace octosurf::surfaces
