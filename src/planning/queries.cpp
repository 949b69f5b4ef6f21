#include "geometry/directions.hpp"
#include "planning/polygon_index.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>
#include <numbers>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/queries.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using namespace planning;

/// One surface with precomputed data.
struct Entry {
  SurfacePtr surface;
  Eigen::Isometry3d T_surface_map;
  Eigen::AlignedBox3d box;  ///< map frame; slightly larger than the polygons
  PolygonIndex polygons;

  explicit Entry(SurfacePtr s)
      : surface(std::move(s)), T_surface_map(surface->T_map_surface.inverse()), polygons(surface->polygons) {
    box = box_of(*surface, surface->T_map_surface);
    if (box.isEmpty()) return;
    // Border points must not depend on the last bit.
    box = box_about(box, 1e-12 * (1 + box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff()));
  }
};
using EntryPtr = std::shared_ptr<const Entry>;

namespace bg = boost::geometry;
using BoostPoint = bg::model::point<double, 3, bg::cs::cartesian>;
using BoostBox = bg::model::box<BoostPoint>;
using BoxTree = bg::index::rtree<std::pair<BoostBox, const Entry*>, bg::index::quadratic<16>>;

BoostPoint boost_point(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }
BoostBox boost_box(const Eigen::AlignedBox3d& box) {
  return {boost_point(box.min()), boost_point(box.max())};
}

void require_point(const Eigen::Vector3d& point, const char* where) {
  if (!point.allFinite()) throw Error(Error::Kind::usage, where, "the point is not finite");
}
/// Throws Error for an invalid direction or angle.
void require_limit(const SlopeLimit& limit) {
  geometry::require_direction(limit.up, "up");
  if (!(limit.max_slope_rad >= 0))
    throw Error(Error::Kind::usage, "max_slope", "is not an angle", "must be at least 0");
}

bool within(const SlopeLimit& limit, const Surface& surface) {
  return limit.max_slope_rad >= std::numbers::pi || slope_rad(surface, limit.up) <= limit.max_slope_rad;
}

void require_distance(double distance, const char* where) {
  if (!(distance >= 0)) throw Error(Error::Kind::usage, where, "is not a distance", "must be at least 0");
}

/// Whether part of the segment lies in the space.
bool meets(const ConvexSpace& space, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  double first = 0, last = 1;
  for (const Plane& plane : space.planes) {
    const double at_a = plane.signed_distance(a), at_b = plane.signed_distance(b);
    if (at_a > 0 && at_b > 0) return false;
    if (at_a > 0) first = std::max(first, at_a / (at_a - at_b));
    if (at_b > 0) last = std::min(last, at_a / (at_a - at_b));
  }
  return first <= last;
}

/// False only if no point of the box lies in the space; may be true near its corners by mistake.
bool may_meet(const ConvexSpace& space, const Eigen::AlignedBox3d& box) {
  for (const Plane& plane : space.planes) {
    const Eigen::Vector3d nearest = (plane.normal.array() > 0).select(box.min(), box.max());
    if (plane.signed_distance(nearest) > 0) return false;
  }
  return true;
}

bool meets(const ConvexSpace& space, const Entry& entry) {
  // The space's intersection with the surface's plane, near the surface.
  std::vector<Eigen::Vector3d> part;
  for (const Eigen::Vector2d& corner : ring_of(entry.polygons.box()))
    part.push_back(entry.surface->to_map(corner));
  for (const Plane& plane : space.planes)
    part = cut(part, [&](const Eigen::Vector3d& p) { return plane.signed_distance(p); });
  if (part.empty()) return false;
  Eigen::AlignedBox2d near;
  for (const Eigen::Vector3d& corner : part) near.extend((entry.T_surface_map * corner).head<2>());
  bool met = false;
  constexpr double slack = 1e-9;
  entry.polygons.for_each_edge_near(
      box_about(near, slack), [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
        met = met || meets(space, entry.surface->to_map(a), entry.surface->to_map(b));
      });
  return met || entry.polygons.contains((entry.T_surface_map * part.front()).head<2>());
}

/// The best answer so far: the nearest, on a tie the lower id.
template <class Answer>
class Best {
 public:
  explicit Best(double within) : limit(within) {}
  void offer(const Answer& answer) {
    if (answer.distance > limit || (any_ && answer.distance == limit && answer.id > found_.id)) return;
    any_ = true;
    found_ = answer;
    limit = answer.distance;
  }
  std::optional<Answer> found() const { return any_ ? std::optional(found_) : std::nullopt; }
  double limit;

 private:
  bool any_ = false;
  Answer found_{};
};

}  // namespace

ConvexSpace ConvexSpace::box(const Eigen::AlignedBox3d& box) {
  ConvexSpace space;
  for (int axis = 0; axis < 3; ++axis) {
    space.planes.push_back({Eigen::Vector3d::Unit(axis), box.max()[axis]});
    space.planes.push_back({-Eigen::Vector3d::Unit(axis), -box.min()[axis]});
  }
  return space;
}

struct SurfaceIndex::Impl {
  std::shared_ptr<const Snapshot> snapshot;
  std::vector<EntryPtr> entries;  ///< of surfaces with polygons; ascending id
  Eigen::AlignedBox3d bounds;
  BoxTree tree;

  /// Of those whose box is in the given one.
  template <class Test>
  std::vector<SurfaceId> list(const Eigen::AlignedBox3d& box, const Test& test) const {
    std::vector<SurfaceId> ids;
    for (auto at = tree.qbegin(bg::index::intersects(boost_box(box))); at != tree.qend(); ++at)
      if (test(*at->second)) ids.push_back(at->second->surface->id);
    std::sort(ids.begin(), ids.end());
    return ids;
  }

  std::optional<RayHit> cast(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double within,
                             const SlopeLimit* limit) const {
    Best<RayHit> best(within);
    if (entries.empty()) return {};
    const double farthest = (bounds.center() - from).norm() + bounds.diagonal().norm();
    const bg::model::segment<BoostPoint> ray(boost_point(from),
                                             boost_point(from + std::min(within, farthest) * along));
    for (auto at = tree.qbegin(bg::index::intersects(ray)); at != tree.qend(); ++at) {
      const Entry& entry = *at->second;
      if (limit != nullptr && !octosurf::within(*limit, *entry.surface)) continue;
      const Eigen::Vector3d start = entry.T_surface_map * from, way = entry.T_surface_map.linear() * along;
      if (std::fabs(way.z()) < 1e-9) continue;  // parallel to the plane
      const double distance = -start.z() / way.z();
      if (distance < 0 || distance > best.limit) continue;
      const Eigen::Vector2d uv = (start + distance * way).head<2>();
      if (entry.polygons.contains(uv))
        best.offer({entry.surface->id, entry.surface->to_map(uv), distance, way.z() < 0});
    }
    return best.found();
  }
};

SurfaceIndex::SurfaceIndex(std::shared_ptr<const Snapshot> snapshot, const SurfaceIndex* previous)
    : impl_(std::make_unique<Impl>()) {
  if (snapshot == nullptr)
    throw Error(Error::Kind::usage, "snapshot", "is null", "give that of a map or a Mapper");
  impl_->snapshot = std::move(snapshot);
  static const std::vector<EntryPtr> none;
  const std::vector<EntryPtr>& known = previous != nullptr ? previous->impl_->entries : none;
  auto at = known.begin();
  std::vector<BoxTree::value_type> boxes;
  for (const SurfacePtr& surface : impl_->snapshot->surfaces) {
    while (at != known.end() && (*at)->surface->id < surface->id) ++at;
    EntryPtr entry = at != known.end() && (*at)->surface == surface ? *at : std::make_shared<Entry>(surface);
    if (entry->box.isEmpty()) continue;
    boxes.emplace_back(boost_box(entry->box), entry.get());
    impl_->bounds.extend(entry->box);
    impl_->entries.push_back(std::move(entry));
  }
  impl_->tree = BoxTree(boxes);
}
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
SurfaceIndex& SurfaceIndex::operator=(SurfaceIndex&&) noexcept = default;
SurfaceIndex::~SurfaceIndex() = default;

const Snapshot& SurfaceIndex::snapshot() const { return *impl_->snapshot; }

std::vector<SurfaceId> SurfaceIndex::in(const ConvexSpace& space) const {
  for (const Plane& plane : space.planes)
    if (!plane.normal.allFinite() || std::isnan(plane.offset))
      throw Error(Error::Kind::usage, "space", "has a plane that is not finite");
  return impl_->list(impl_->bounds,
                     [&](const Entry& entry) { return may_meet(space, entry.box) && meets(space, entry); });
}

std::vector<SurfaceId> SurfaceIndex::in_sphere(const Eigen::Vector3d& center, double radius) const {
  require_point(center, "in_sphere");
  require_distance(radius, "radius");
  return impl_->list(box_about(Eigen::AlignedBox3d(center), radius), [&](const Entry& entry) {
    const auto uv = entry.polygons.closest((entry.T_surface_map * center).head<2>(), radius);
    return uv && (entry.surface->to_map(*uv) - center).norm() <= radius;
  });
}

std::optional<Nearest> SurfaceIndex::nearest(const Eigen::Vector3d& point, const SlopeLimit& limit,
                                             double within) const {
  require_point(point, "nearest");
  require_distance(within, "within");
  require_limit(limit);
  Best<Nearest> best(within);
  const BoxTree& tree = impl_->tree;
  if (tree.empty()) return {};
  for (auto at = tree.qbegin(bg::index::nearest(boost_point(point), static_cast<unsigned>(tree.size())));
       at != tree.qend(); ++at) {
    const Entry& entry = *at->second;
    if (entry.box.exteriorDistance(point) > best.limit) break;  // the others are farther
    const Eigen::Vector3d local = entry.T_surface_map * point;
    if (std::fabs(local.z()) > best.limit || !octosurf::within(limit, *entry.surface)) continue;
    const auto uv = entry.polygons.closest(local.head<2>(), best.limit);
    if (!uv) continue;
    const Eigen::Vector3d on_surface = entry.surface->to_map(*uv);
    best.offer({entry.surface->id, on_surface, (on_surface - point).norm()});
  }
  return best.found();
}

std::optional<Nearest> SurfaceIndex::below(const Eigen::Vector3d& point, const SlopeLimit& limit) const {
  require_point(point, "below");
  require_limit(limit);
  const std::optional<RayHit> hit = impl_->cast(point, -limit.up.normalized(), HUGE_VAL, &limit);
  if (!hit) return {};
  return Nearest{hit->id, hit->point, hit->distance};
}

std::optional<RayHit> SurfaceIndex::first_on_ray(const Eigen::Vector3d& from,
                                                 const Eigen::Vector3d& direction, double within) const {
  require_point(from, "first_on_ray");
  geometry::require_direction(direction, "direction");
  require_distance(within, "within");
  return impl_->cast(from, direction.normalized(), within, nullptr);
}

}  // namespace octosurf
