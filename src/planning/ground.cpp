#include "geometry/even_odd.hpp"
#include "occupancy/cubes.hpp"
#include "planning/column.hpp"
#include "planning/contact_cells.hpp"
#include "planning/contact_shape.hpp"
#include "planning/ground_tiles.hpp"
#include "planning/made_once.hpp"
#include "planning/rings.hpp"
#include "planning/voxel_matter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <variant>

#include <octosurf/error.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using namespace planning;

/// nullptr if there is none.
const SurfacePtr* surface_of(const Snapshot& snapshot, SurfaceId id) {
  const auto surface =
      std::lower_bound(snapshot.surfaces.begin(), snapshot.surfaces.end(), id,
                       [](const SurfacePtr& one, SurfaceId wanted) { return one->id < wanted; });
  return surface != snapshot.surfaces.end() && (*surface)->id == id ? &*surface : nullptr;
}

const SurfacePtr& mapped_surface(const Snapshot& snapshot, SurfaceId id) {
  const SurfacePtr* surface = surface_of(snapshot, id);
  if (surface == nullptr)
    throw Error(Error::Kind::data, "surface " + std::to_string(id), "is not in the map");
  return *surface;
}

// m, half a voxel of 2 cm: the accuracy of outlines and voxels. As an edge margin: outlines extend up to a
// voxel beyond the true edge (contact.hpp), so with half a voxel a sole overhangs by at most the other half,
// a centimetre, which is tolerable. A whole voxel would avoid overhang, but leave no foothold on treads below
// 0.26 m; on simulated stairs, stones and rubble plans were as safe with either.
constexpr double half_voxel = 0.01;

// m: from there a swinging foot is lowered, so space under it must be known. Higher up swings are checked.
constexpr double usual_lift = 0.10;

ContactLimits usual_limits(double room_m) {
  ContactLimits limits;
  limits.edge_margin_m = half_voxel;
  limits.obstacle_margin_m = half_voxel;
  limits.clearance_m = room_m;
  limits.unknown_to_m = usual_lift;
  return limits;
}

}  // namespace

ContactLimits Biped::limits() { return usual_limits(0.45); }
ContactLimits Quadruped::limits() { return usual_limits(0.20); }

struct GroundView::Solids : MadeOnce<SurfaceId, std::shared_ptr<const GroundTiles>> {};
struct GroundView::Squares : MadeOnce<std::tuple<SurfaceId, int, int>, ContactCells> {};
/// Stairs, and the level surfaces that they were found on.
struct GroundView::Climb {
  struct Found {
    std::vector<SurfacePtr> level;
    Eigen::Vector3d up;
    Stairs stairs;
  };
  MadeOnce<int, Found> now;
  std::optional<Found> before;  ///< of an earlier snapshot
};
struct GroundView::Outlines : MadeOnce<SurfaceId, SurfacePtr> {};

GroundRules GroundRules::of(const Robot& robot, double resolution) {
  GroundRules rules;
  std::visit([&rules](const auto& kind) { rules.foot = kind.foot, rules.limits = kind.contact; }, robot);
  rules.limits.clearance_m = std::visit([](const auto& kind) { return kind.body.to_m; }, robot);
  rules.limits.edge_margin_m = std::max(rules.limits.edge_margin_m, resolution);
  rules.limits.obstacle_margin_m = std::max(rules.limits.obstacle_margin_m, resolution);
  return rules;
}

double widest_unseen_of(const ContactShape& shape, double share) {
  const Eigen::AlignedBox2d box = box_of(shape.outline);
  return share * (box.isEmpty() ? 2 * shape.radius : box.sizes().minCoeff());
}

GroundView::GroundView(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree,
                       const GroundRules& rules)
    : snapshot_(std::move(snapshot)),
      octree_(std::move(octree)),
      rules_(rules),
      solids_(std::make_shared<Solids>()),
      supported_(std::make_shared<Outlines>()),
      squares_(std::make_shared<Squares>()),
      climb_(std::make_shared<Climb>()) {
  if (octree_.resolution() <= 0)
    throw Error(Error::Kind::usage, "ground", "cannot be known without an octree", "give the map's");
}

double GroundView::widest_unseen_m() const {
  return rules_.widest_unseen_m ? *rules_.widest_unseen_m : widest_unseen_of(rules_.foot);
}

GroundView GroundView::by(const GroundRules& rules) const {
  GroundView other(snapshot_, octree_, rules);
  if (rules.as_mapped == rules_.as_mapped && other.widest_unseen_m() == widest_unseen_m()) {
    other.solids_ = solids_;
    if (rules.limits.up == rules_.limits.up) other.climb_ = climb_;
  }
  return other;
}

GroundView GroundView::next(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree) const {
  GroundView other(std::move(snapshot), std::move(octree), rules_);
  if (other.octree_.resolution() != octree_.resolution()) return other;
  std::vector<Eigen::AlignedBox3d> changed = occupancy::changed_cubes(octree_, other.octree_);
  solids_->for_each([&](SurfaceId id, const std::shared_ptr<const GroundTiles>& before) {
    const SurfacePtr* now = surface_of(*other.snapshot_, id);
    if (now == nullptr) return;
    other.solids_->get(id, [&] { return std::make_shared<GroundTiles>(*before, *now, changed); });
  });
  // Squares of unchanged ground near which neither voxels nor surfaces changed.
  for (const SurfacePtr& now : other.snapshot_->surfaces) {
    const SurfacePtr* before = surface_of(*snapshot_, now->id);
    if (before == nullptr || *before == now) continue;
    changed.push_back(box_of(*now, now->T_map_surface));
  }
  // Matter is moved onto its plane; unknown voxels depend on two beside.
  const double reach = std::max(rules_.limits.clearance_m, rules_.limits.unknown_to_m) +
                       MatterOfVoxels::farthest_move + 3 * octree_.resolution();
  other.squares_->share(*squares_, [&](const std::tuple<SurfaceId, int, int>& key) {
    const auto [id, x, y] = key;
    const SurfacePtr* now = surface_of(*other.snapshot_, id);
    if (now == nullptr || !other.tiles_of(id)->same_as_before()) return false;
    const Eigen::AlignedBox3d about =
        box_about(box_over((*now)->T_map_surface, square_of(x, y), 0, 0), reach);
    return std::ranges::none_of(changed, [&](const auto& box) { return box.intersects(about); });
  });
  other.climb_->before = climb_->before;
  climb_->now.for_each([&](int, const Climb::Found& now) { other.climb_->before = now; });
  return other;
}

std::shared_ptr<const GroundTiles> GroundView::tiles_of(SurfaceId id) const {
  const SurfacePtr& surface = mapped_surface(*snapshot_, id);
  return solids_->get(
      id, [&] { return std::make_shared<GroundTiles>(surface, octree_.resolution(), widest_unseen_m()); });
}

SurfacePtr GroundView::solid(SurfaceId id) const {
  return rules_.as_mapped ? mapped_surface(*snapshot_, id) : tiles_of(id)->solid(octree_);
}

const std::vector<Gap>& GroundView::gaps(SurfaceId id) const {
  static const std::vector<Gap> none;
  if (rules_.as_mapped) return mapped_surface(*snapshot_, id), none;
  return tiles_of(id)->gaps(octree_);
}

std::optional<Ground> GroundView::ground_within(SurfaceId id, const Eigen::Vector3d& at) const {
  const std::shared_ptr<const GroundTiles> tiles = tiles_of(id);
  return tiles->ground_at((tiles->surface().T_map_surface.inverse() * at).head<2>(), octree_);
}

Ground GroundView::ground_at(SurfaceId id, const Eigen::Vector3d& at) const {
  if (const std::optional<Ground> within = ground_within(id, at)) return *within;
  const Surface& surface = *mapped_surface(*snapshot_, id);
  const Eigen::Vector2d uv = (surface.T_map_surface.inverse() * at).head<2>();
  const GroundPlane plane{id, octree_.resolution(), surface.rms_m, surface.T_map_surface};
  const Columns::Seen seen = Columns(octree_, plane, Eigen::AlignedBox2d(uv)).at(uv);
  return seen.open ? Ground::open : seen.blocked ? Ground::blocked : Ground::unseen;
}

std::array<double, ground_names.size()> GroundView::ground_under(
    SurfaceId id, const Eigen::Isometry3d& T_map_contact) const {
  std::array<double, ground_names.size()> shares{};
  const Ring2 outline = rules_.foot.outline.empty() ? around_disc(rules_.foot.radius) : rules_.foot.outline;
  const Eigen::AlignedBox2d box = box_of(outline);
  // Effort: any size may be given. At least nine points.
  constexpr double samples_along = 64;
  const double step = std::max(std::min(octree_.resolution() / 2, box.sizes().minCoeff() / 3),
                               box.sizes().maxCoeff() / samples_along);
  double sum = 0;
  for (double y = box.min().y() + step / 2; y < box.max().y(); y += step)
    for (double x = box.min().x() + step / 2; x < box.max().x(); x += step) {
      if (!geometry::inside(outline, {x, y})) continue;
      ++shares[static_cast<std::size_t>(ground_at(id, T_map_contact * Eigen::Vector3d(x, y, 0)))];
      ++sum;
    }
  for (double& share : shares) share /= std::max(1.0, sum);
  return shares;
}

SurfacePtr GroundView::supported(SurfaceId id) const {
  return supported_->get(id, [&] {
    const SurfacePtr ground = solid(id);
    const Surface& surface = *ground;
    ContactLimits limits = rules_.limits;
    if (slope_rad(surface, limits.up) > limits.max_slope_rad)
      limits.clearance_m = limits.obstacle_margin_m = limits.unknown_to_m = 0;
    limits.max_slope_rad = std::numbers::pi;
    constexpr double point = 1e-6;  // m, a disc's radius
    return with_outline(
        surface,
        contact_region(surface, ContactShape::disc(point), {}, limits, &octree_, snapshot_.get()).polygons);
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

const Stairs& GroundView::stairs() const {
  constexpr double steepest = 15 * std::numbers::pi / 180;  // no tread of stairs.hpp, which are level to 10°
  return climb_->now
      .get(0,
           [&] {
             Climb::Found found{{}, rules_.limits.up, {}};
             for (const SurfacePtr& surface : snapshot_->surfaces)
               if (slope_rad(*surface, found.up) <= steepest) found.level.push_back(solid(surface->id));
             const auto same = [](const SurfacePtr& a, const SurfacePtr& b) {
               return a->id == b->id && same_outline(*a, *b);
             };
             const std::optional<Climb::Found>& before = climb_->before;
             if (before && before->up == found.up && std::ranges::equal(found.level, before->level, same))
               found.stairs = before->stairs;
             else
               found.stairs = find_stairs(*solid(), found.up);
             return found;
           })
      .stairs;
}

ContactRegion GroundView::region(SurfaceId id, std::optional<double> yaw_rad) const {
  return contact_region(*solid(id), rules_.foot, yaw_rad, rules_.limits, &octree_, snapshot_.get());
}

/// With the outline of its ground in a box.
Surface GroundView::part_of(SurfaceId id, const Eigen::AlignedBox2d& box) const {
  const std::shared_ptr<const GroundTiles> tiles = tiles_of(id);
  const Surface& mapped = tiles->surface();
  Surface part;  // the rest of it may be large
  part.id = id;
  part.resolution = mapped.resolution;
  part.plane = mapped.plane;
  part.T_map_surface = mapped.T_map_surface;
  part.area_m2 = mapped.area_m2;
  part.inliers = mapped.inliers;
  part.rms_m = mapped.rms_m;
  part.covariance = mapped.covariance;
  part.revision = mapped.revision;
  part.polygons = tiles->solid_within(box, octree_, rules_.as_mapped);
  return part;
}

ContactRegion GroundView::region_about(SurfaceId id, const Eigen::Vector3d& about, double reach_m,
                                       std::optional<double> yaw_rad) const {
  if (!about.allFinite() || !(reach_m > 0))
    throw Error(Error::Kind::usage, "region_about", "the place or its reach is not a number or not positive");
  const Surface& mapped = tiles_of(id)->surface();
  const ContactLimits& limits = rules_.limits;
  require_sensible(rules_.foot, yaw_rad, limits, &octree_);
  const Eigen::Vector2d at = (mapped.T_map_surface.inverse() * about).head<2>();
  const Eigen::AlignedBox2d window = box_about(at, reach_m).intersection(box_of(mapped));
  if (window.isEmpty()) return {id, mapped.revision, yaw_rad, {}, 0, {ContactRefusal::support}};
  // Beyond lies what counts as outside, by the contact's reach and some cells.
  const Eigen::AlignedBox2d wide =
      box_about(window, rules_.foot.reach() + std::max(limits.edge_margin_m, limits.obstacle_margin_m) +
                            2 * octree_.resolution());
  ContactCells cells(wide, BitRaster::edge_for(mapped));
  for (const ContactCells* square : cells_in(id, wide)) {
    cells.outside.add(square->outside);
    cells.obstacles.add(square->obstacles);
    cells.unknown.add(square->unknown);
  }
  ContactRegion region = region_on(cells, mapped, rules_.foot, yaw_rad, limits);
  region.polygons = reshaped(clipped(region.polygons, window), {}, {});
  region.area_m2 = area_of(region.polygons);
  return region;
}

Eigen::AlignedBox2d GroundView::square_of(int x, int y) const {
  const double edge = 64 * octree_.resolution();
  const Eigen::Vector2d corner = edge * Eigen::Vector2d(x, y);
  return {corner, corner.array() + edge};
}

/// The squares of 64 voxels that meet a box.
std::vector<const ContactCells*> GroundView::cells_in(SurfaceId id, const Eigen::AlignedBox2d& box) const {
  const double d = octree_.resolution(), edge = square_of(0, 0).max().x();
  const Eigen::Array2i low = (box.min() / edge).array().floor().cast<int>(),
                       high = (box.max() / edge).array().floor().cast<int>();
  std::vector<const ContactCells*> all;
  for (int y = low.y(); y <= high.y(); ++y)
    for (int x = low.x(); x <= high.x(); ++x)
      all.push_back(&squares_->get({id, x, y}, [&] {
        const Eigen::AlignedBox2d square = square_of(x, y);
        const double cell = BitRaster::edge_for(tiles_of(id)->surface());
        return ContactCells(part_of(id, box_about(square, d)), square, square, cell, rules_.limits, &octree_,
                            snapshot_.get());
      }));
  return all;
}

Foothold GroundView::foothold(SurfaceId id, const Eigen::Vector3d& at, double yaw_rad) const {
  if (!at.allFinite()) throw Error(Error::Kind::usage, "foothold", "the point is not finite");
  const Surface& surface = tiles_of(id)->surface();
  require_sensible(rules_.foot, yaw_rad, rules_.limits, &octree_);
  const double margin =
      std::max({Foothold::farthest_margin_m, rules_.limits.edge_margin_m, rules_.limits.obstacle_margin_m});
  const Eigen::AlignedBox2d box =
      box_about((surface.T_map_surface.inverse() * at).head<2>(), 1.01 * (rules_.foot.reach() + margin));
  if (!box.intersects(box_of(surface)))
    return foothold_on({}, surface, rules_.foot, at, yaw_rad, rules_.limits);
  return foothold_on(cells_in(id, box), surface, rules_.foot, at, yaw_rad, rules_.limits);
}

}  // namespace octosurf
