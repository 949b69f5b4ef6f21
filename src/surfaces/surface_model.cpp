#include "surfaces/surface_model.hpp"

#include "geometry/plane_covariance.hpp"
#include "geometry/rings.hpp"
#include "surfaces/reading_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <octosurf/adapters/detail/morton.hpp>

namespace octosurf::surfaces {
namespace {

/// Of the hash frame against the plane. It shifts an outline's vertex by 1/57 of its inlier's distance
/// from the plane, whatever the surface's extent: far less than a voxel. Rehashing costs O(n).
constexpr double cos_largest_tilt = 0.99984769515639;  // 1°

/// Square of what the inliers' own points move the plane along its normal, beyond what chance does: rays free
/// the voxels before a plane, not those behind it, and a voxel behind that noise reached once counts as much
/// as one that each scan hits. Repeated observations weigh by their number, so that the difference of the
/// two tells it.
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

/// From a point inside a cube, along a unit direction, to the cube's side. `at`: from the cube's centre.
double to_side(const Eigen::Vector3d& at, const Eigen::Vector3d& direction, double half_edge) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double speed = std::fabs(direction[axis]);
    if (speed < 1e-9) continue;
    const double left = half_edge - std::copysign(1.0, direction[axis]) * at[axis];
    nearest = std::min(nearest, std::max(0.0, left) / speed);
  }
  return nearest;
}

}  // namespace

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
  pose_.linear() = geometry::plane_axes(plane.normal);
  pose_.translation() = origin - plane.signed_distance(origin) * plane.normal;
  set_hash_frame(pose_);
  overreach_.fill(resolution);
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
  for (int ring = 0; ring <= reach; ++ring)
    for (int v = -ring; v <= ring; ++v)
      for (int u = -ring; u <= ring; u += (std::abs(v) == ring ? 1 : 2 * ring))
        if (const geometry::PlaneCell at{cell.u + u, cell.v + v}; occupied(at)) return at;
  return {};
}

Eigen::Vector3d SurfaceModel::centre_of(geometry::PlaneCell cell) const {
  return hash_frame_ * Eigen::Vector3d((cell.u + 0.5) * resolution_, (cell.v + 0.5) * resolution_, 0);
}

void SurfaceModel::insert(const Inlier& inlier) {
  const geometry::PlaneCell cell = cell_of(inlier.position);
  inliers_.add(cell, inlier);
  // A point deep inside the boundary does not move it (paper III-B).
  if (bits_.change(cell, true)) polygons_stale_ = true;
  ++size_;
}

void SurfaceModel::add(const Inlier& inlier) {
  insert(inlier);
  ++unchecked;
  moments_[inlier.range_class].add(inlier.position.cast<double>() - reference_);
}

bool SurfaceModel::remove(geometry::VoxelKey key, const Eigen::Vector3f& position) {
  const geometry::PlaneCell at = cell_of(position);
  const std::optional<InlierTiles::Removed> removed = inliers_.remove(at, key);
  if (!removed) return false;
  const Inlier& inlier = removed->inlier;
  moments_[inlier.range_class].add(inlier.position.cast<double>() - reference_, -1);
  // Which of the evidence is of this inlier is not known, so an average share of it is removed.
  fade(1 - 1 / static_cast<double>(size_));
  --size_;
  ++unchecked;
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
    // Weighted like the evidence: by the measured noise, relative to the noise allowed to the nearest class.
    const double ratio = noise != nullptr ? noise->sigma(1) / std::max(noise->measured_sigma(c), 1e-6) : 1;
    sum.add(moments_[c], ratio * ratio);
  }
  if (noise != nullptr) sum.add(evidence_.moments);
  return sum;
}

void SurfaceModel::observe(const Eigen::Vector3f& position, double weight) {
  constexpr double max_readings = 100;  // an inlier
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
  if (hash_frame_.linear().col(2).dot(plane_.normal) > cos_largest_tilt) return;
  set_hash_frame(pose_);
  const std::vector<Inlier> all = sorted_inliers();
  inliers_.clear();
  bits_.clear();
  outline_.reset();
  size_ = 0;
  for (const Inlier& inlier : all) insert(inlier);
  polygons_stale_ = true;
}

Eigen::Vector2d SurfaceModel::outline_point(const Eigen::Vector3f& p) const {
  const Eigen::Vector2d cells =
      hash_frame_.linear().leftCols<2>().transpose() * (p.cast<double>() - hash_origin_) / resolution_;
  return (cells / geometry::Outline::quantum).array().round() * geometry::Outline::quantum;
}

double SurfaceModel::outline_alpha(double max_hole_size) const {
  return max_hole_size * cos_largest_tilt / resolution_;
}

Eigen::Affine2d SurfaceModel::T_surface_outline() const {
  const Eigen::Vector3d along = hash_frame_.linear().col(2);
  const auto on_plane = [&](double u, double v) -> Eigen::Vector2d {
    const Eigen::Vector3d p = hash_frame_ * Eigen::Vector3d(u * resolution_, v * resolution_, 0);
    const Eigen::Vector3d q = p - plane_.signed_distance(p) / plane_.normal.dot(along) * along;
    return (pose_.linear().transpose() * (q - pose_.translation())).head<2>();
  };
  Eigen::Affine2d T = Eigen::Affine2d::Identity();
  T.translation() = on_plane(0, 0);
  T.linear().col(0) = on_plane(1, 0) - T.translation();
  T.linear().col(1) = on_plane(0, 1) - T.translation();
  return T;
}

/// Away from the occupied cells among the 5 × 5 about one, if that is clear: the sum of their places is 15
/// cells at a straight rim, 9 at the end of a bar three wide, and at most 3 at a pinhole.
std::optional<Eigen::Vector3d> SurfaceModel::outward(geometry::PlaneCell cell) const {
  constexpr std::uint32_t next_to_it = 0b00000'01110'01010'01110'00000, row = 0b11111, column = 0x108421;
  constexpr int clear = 5;
  const std::uint32_t around = bits_.around(cell);
  if ((around & next_to_it) == next_to_it) return {};
  Eigen::Vector2i inward(0, 0);
  for (const int k : {-2, -1, 1, 2})
    inward += k * Eigen::Vector2i(detail::bit_count(around & column << (k + 2)),
                                  detail::bit_count(around & row << 5 * (k + 2)));
  if (inward.squaredNorm() < clear * clear) return {};
  return -(hash_frame_.linear().leftCols<2>() * inward.cast<double>().normalized());
}

std::optional<Eigen::Vector3f> SurfaceModel::rim_point(const Inlier& inlier, double overreach) const {
  constexpr double worth_a_site = 0.1;  // d
  const auto direction = outward(cell_of(inlier.position));
  if (!direction) return {};
  const Eigen::Vector3d at =
      (inlier.position - geometry::VoxelGrid(resolution_).centre_of(inlier.key)).cast<double>();
  if (at.norm() < resolution_ / 256) return {};  // adopted from an octree: no reading
  const double half = resolution_ / 2;
  const double beyond = std::min(to_side(at, *direction, half), to_side(at, -*direction, half)) - overreach;
  if (beyond < worth_a_site * resolution_) return {};
  return (inlier.position.cast<double>() + beyond * *direction).cast<float>();
}

/// Deep inside, a lattice of every `spacing`-th cell's centre stands in for the inliers, every other
/// row shifted by half of that, so that no four are cocircular.
///
/// Only triangles with a side over α > 3.99 cells are dropped. Their empty circles have radius
/// ρ > α/2, those of the reduced sites are empty of inliers and the other way round, and so the rings
/// are those of all inliers: (1) A circle centred off the deep cells meets none of them. On the way
/// from the centre to a deep cell, the point √2 before the first one would lie in an occupied cell of
/// the rim that the circle contains. (2) A circle centred in a deep cell holds a site: the lattice's
/// largest empty circle has radius ⅝·spacing, and where a lattice cell is not deep, an occupied cell of
/// the rim lies on the way to it, within √2 of the point where that way leaves the deep cells. So
/// ⅝·spacing + √2 ≤ α/2 will do; for a spacing of 2, going through the places in a cell, α > 3.99.
/// Rim points are sites beside the inliers of cells that are not deep, with and without the lattice.
void SurfaceModel::sites_of(geometry::PlaneCell cell, int spacing,
                            std::vector<Eigen::Vector2d>& sites) const {
  sites.clear();
  if (bits_.deep_inside(cell)) {
    const int shift = (cell.v & spacing) != 0 ? spacing / 2 : 0;
    if (cell.v % spacing == 0 && (cell.u + shift) % spacing == 0)
      sites.emplace_back(cell.u + 0.5, cell.v + 0.5);
    return;
  }
  inliers_.for_each_in(cell, [&](const Inlier& inlier) {
    sites.push_back(outline_point(inlier.position));
    const double overreach = overreach_[inlier.range_class];
    if (overreach >= resolution_) return;
    if (const auto p = rim_point(inlier, overreach)) sites.push_back(outline_point(*p));
  });
}

void SurfaceModel::derive(double max_hole_size, const sensing::NoiseModel* noise) {
  const double alpha = outline_alpha(max_hole_size);
  Overreach overreach;
  overreach.fill(resolution_);
  for (unsigned c = 0; noise != nullptr && c < sensing::NoiseModel::classes; ++c)
    overreach[c] = std::min(resolution_, noise->overreach(c));
  const bool other_alpha = !outline_ || outline_->alpha() != alpha;
  if (other_alpha) outline_.emplace(alpha);
  if (other_alpha || overreach != overreach_) bits_.change_all();
  overreach_ = overreach;
  int spacing = 2;
  while (spacing < 16 && 0.625 * (2 * spacing) + std::numbers::sqrt2 <= alpha / 2) spacing *= 2;
  std::vector<Eigen::Vector2d> sites;
  for (const geometry::CellBits::Cells& cells : bits_.take_changes(alpha > 3.99))
    cells.for_each([&](geometry::PlaneCell cell) {
      sites_of(cell, spacing, sites);
      outline_->set(cell, sites);
    });
  polygons_ = outline_->update();
  const Eigen::Affine2d T = T_surface_outline();
  for (Polygon& polygon : polygons_) {
    for (Eigen::Vector2d& p : polygon.outer) p = T * p;
    for (Ring2& hole : polygon.holes)
      for (Eigen::Vector2d& p : hole) p = T * p;
  }
  polygons_stale_ = false;
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
  surface->polygons = polygons_;
  for (const Polygon& polygon : polygons_) {
    for (const Eigen::Vector2d& p : polygon.outer) surface->boundary.push_back(surface->to_map(p));
    for (const Ring2& hole : polygon.holes)
      for (const Eigen::Vector2d& p : hole) surface->boundary.push_back(surface->to_map(p));
    surface->area_m2 += geometry::area_of(polygon);
  }
  surface->inliers = size_;
  surface->rms_m = rms();
  surface->covariance = covariance_;
  surface->born = born;
  surface->revision = map_revision;
  surface->parents = parents_;
  return surface;
}

SurfaceModel::State SurfaceModel::head() const {
  return {
      id_, plane_, checked_plane, pose_,           hash_frame_, reference_, moments_, evidence_, covariance_,
      {},  {},     parents_,      polygons_stale_, born,        revision,   unchecked};
}

SurfaceModel::State SurfaceModel::state() const {
  State state = head();
  state.inliers = sorted_inliers();
  state.polygons = polygons_;
  return state;
}

SurfaceModel::SurfaceModel(const State& state, double resolution)
    : SurfaceModel(state.id, state.plane, state.reference, resolution) {
  checked_plane = state.checked_plane;
  born = state.born;
  revision = state.revision;
  unchecked = state.unchecked;
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
