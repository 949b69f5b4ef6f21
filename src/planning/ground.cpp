#include "planning/ground_tiles.hpp"
#include "planning/made_once.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <variant>

#include <octosurf/error.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

/// nullptr if there is none.
const SurfacePtr* surface_of(const Snapshot& snapshot, SurfaceId id) {
  const auto surface =
      std::lower_bound(snapshot.surfaces.begin(), snapshot.surfaces.end(), id,
                       [](const SurfacePtr& one, SurfaceId wanted) { return one->id < wanted; });
  return surface != snapshot.surfaces.end() && (*surface)->id == id ? &*surface : nullptr;
}

double widest_unseen(const GroundRules& rules) {
  return rules.widest_unseen_m ? *rules.widest_unseen_m : widest_unseen_of(rules.foot);
}

}  // namespace

struct GroundView::Solids : planning::MadeOnce<SurfaceId, std::shared_ptr<const planning::GroundTiles>> {};
struct GroundView::Outlines : planning::MadeOnce<SurfaceId, SurfacePtr> {};

GroundRules GroundRules::of(const Robot& robot, double resolution) {
  GroundRules rules;
  std::visit([&rules](const auto& kind) { rules.foot = kind.foot, rules.limits = kind.contact; }, robot);
  rules.limits.clearance_m = std::visit([](const auto& kind) { return kind.body.to_m; }, robot);
  rules.limits.edge_margin_m = std::max(rules.limits.edge_margin_m, resolution);
  rules.limits.obstacle_margin_m = std::max(rules.limits.obstacle_margin_m, resolution);
  return rules;
}

GroundView::GroundView(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree,
                       const GroundRules& rules)
    : snapshot_(std::move(snapshot)),
      octree_(std::move(octree)),
      rules_(rules),
      solids_(std::make_shared<Solids>()),
      supported_(std::make_shared<Outlines>()) {
  if (octree_.resolution() <= 0)
    throw Error(Error::Kind::usage, "ground", "cannot be known without an octree", "give the map's");
}

GroundView GroundView::by(const GroundRules& rules) const {
  GroundView other(snapshot_, octree_, rules);
  if (rules.as_mapped == rules_.as_mapped && widest_unseen(rules) == widest_unseen(rules_))
    other.solids_ = solids_;
  return other;
}

GroundView GroundView::next(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree) const {
  GroundView other(std::move(snapshot), std::move(octree), rules_);
  if (other.octree_.resolution() != octree_.resolution()) return other;
  std::vector<Eigen::AlignedBox3d> changed;
  const double d = octree_.resolution();
  other.octree_.for_each_changed_cube(octree_, [&](const std::array<std::uint16_t, 3>& corner, int level) {
    constexpr double origin = 32768;  // key of the voxel that begins at 0 m
    const Eigen::Vector3d low(d * (corner[0] - origin), d * (corner[1] - origin), d * (corner[2] - origin));
    changed.emplace_back(low, low + Eigen::Vector3d::Constant(std::ldexp(d, level)));
  });
  solids_->for_each([&](SurfaceId id, const std::shared_ptr<const planning::GroundTiles>& before) {
    const SurfacePtr* now = surface_of(*other.snapshot_, id);
    if (now == nullptr) return;
    other.solids_->get(id, [&] { return std::make_shared<planning::GroundTiles>(*before, *now, changed); });
  });
  return other;
}

std::shared_ptr<const planning::GroundTiles> GroundView::tiles_of(SurfaceId id) const {
  const SurfacePtr* surface = surface_of(*snapshot_, id);
  if (surface == nullptr)
    throw Error(Error::Kind::data, "surface " + std::to_string(id), "is not in the map");
  return solids_->get(id, [&] {
    return std::make_shared<planning::GroundTiles>(*surface, octree_.resolution(), widest_unseen(rules_));
  });
}

SurfacePtr GroundView::solid(SurfaceId id) const {
  const std::shared_ptr<const planning::GroundTiles> tiles = tiles_of(id);
  return rules_.as_mapped ? *surface_of(*snapshot_, id) : tiles->solid(octree_);
}

const std::vector<Gap>& GroundView::gaps(SurfaceId id) const {
  static const std::vector<Gap> none;
  const std::shared_ptr<const planning::GroundTiles> tiles = tiles_of(id);
  return rules_.as_mapped ? none : tiles->gaps(octree_);
}

SurfacePtr GroundView::supported(SurfaceId id) const {
  return supported_->get(id, [&] {
    const SurfacePtr ground = solid(id);
    const Surface& surface = *ground;
    ContactLimits limits = rules_.limits;
    limits.frontier_margin_m = 0;  // needs label_edges(), which needs the map
    if (slope_rad(surface, limits.up) > limits.max_slope_rad)
      limits.clearance_m = limits.obstacle_margin_m = 0;
    limits.max_slope_rad = std::numbers::pi;
    constexpr double point = 1e-6;  // m, a disc's radius
    return planning::with_outline(surface, contact_region(surface, ContactShape::disc(point), {}, limits,
                                                          &octree_, nullptr, snapshot_.get())
                                               .polygons);
  });
}

std::shared_ptr<const Snapshot> GroundView::solid() const {
  auto all = std::make_shared<Snapshot>(*snapshot_);
  for (SurfacePtr& surface : all->surfaces) surface = solid(surface->id);
  return all;
}

std::shared_ptr<const Snapshot> GroundView::supported() const {
  auto all = std::make_shared<Snapshot>(*snapshot_);
  for (SurfacePtr& surface : all->surfaces) surface = supported(surface->id);
  return all;
}

std::map<SurfaceId, std::vector<Gap>> GroundView::gaps() const {
  std::map<SurfaceId, std::vector<Gap>> all;
  for (const SurfacePtr& surface : snapshot_->surfaces)
    if (const std::vector<Gap>& of_one = gaps(surface->id); !of_one.empty()) all[surface->id] = of_one;
  return all;
}

ContactRegion GroundView::region(SurfaceId id, std::optional<double> yaw_rad,
                                 const std::vector<PolygonEdges>* edges) const {
  return contact_region(*solid(id), rules_.foot, yaw_rad, rules_.limits, &octree_, edges, snapshot_.get());
}

Foothold GroundView::foothold(SurfaceId id, const Eigen::Vector3d& at, double yaw_rad,
                              const std::vector<PolygonEdges>* edges) const {
  return octosurf::foothold(*solid(id), rules_.foot, at, yaw_rad, rules_.limits, &octree_, edges,
                            snapshot_.get());
}

}  // namespace octosurf
