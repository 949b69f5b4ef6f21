#include "footsteps/foothold_field.hpp"

#include "planning/cell_runs.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <array>
#include <boost/container/static_vector.hpp>
#include <cmath>
#include <tuple>

#include <octosurf/up.hpp>

namespace octosurf::footsteps {
namespace {

constexpr double largest_margin = 0.06;  // m; beyond it the cell's middle is as good as any point

double wrapped(double angle, double period) { return angle - period * std::floor(angle / period); }

constexpr double below_ground = 0.5;  // m of the octree used below the lowest surface

/// The main direction, in [0, `period`), of the surfaces' edges, weighted by length: buildings have few
/// directions, and a sole aligned with a tread needs less of it. Walking frame.
double edge_direction(const std::vector<FootholdField::Ground>& surfaces, double period) {
  // Directions modulo `period` mapped to a circle, so that 0 and `period` coincide.
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const FootholdField::Ground& ground : surfaces)
    planning::for_each_edge(
        simplified(*ground.surface), [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
          const Eigen::Vector2d along = (ground.T_walk_surface.linear().topLeftCorner<2, 2>() * (to - from));
          const double turn = 2 * std::numbers::pi * std::atan2(along.y(), along.x()) / period;
          // Squared, to favour the long edges of straight outlines over the many short ones of round
          // outlines.
          sum += along.squaredNorm() * Eigen::Vector2d(std::cos(turn), std::sin(turn));
        });
  if (sum.norm() == 0) return 0;
  return wrapped(std::atan2(sum.y(), sum.x()) * period / (2 * std::numbers::pi), period);
}

// Surfaces that are level enough, and their place in the walking frame.
std::vector<FootholdField::Ground> level_surfaces(const Snapshot& snapshot, const ContactLimits& limits) {
  const Eigen::Quaterniond R_walk_map = upright(limits.up);
  std::vector<FootholdField::Ground> found;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if (slope_rad(*surface, limits.up) > limits.max_slope_rad) continue;
    const Eigen::Isometry3d T = R_walk_map * surface->T_map_surface;
    if (const Eigen::AlignedBox3d box = planning::box_of(*surface, T); !box.isEmpty())
      found.push_back({surface, T, box});
  }
  return found;
}

Eigen::AlignedBox3d box_of(const std::vector<FootholdField::Ground>& surfaces) {
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero());
  if (!surfaces.empty()) box = surfaces[0].box;
  for (const FootholdField::Ground& ground : surfaces) box.extend(ground.box);
  return box;
}

}  // namespace

RegionRaster::RegionRaster(const std::vector<Polygon>& polygons, const Eigen::Isometry3d& T, double pixel,
                           double cap)
    : pixels({0, 0}, {0, 0}, pixel) {
  std::vector<Polygon> seen = polygons;
  planning::for_each_ring(seen, [&](Ring2& ring) {
    for (Eigen::Vector2d& p : ring) p = (T * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>();
  });
  const planning::CellRuns runs(seen, pixel);
  if (runs.box().isEmpty()) return;
  // Whole cells, with a pixel outside on every side.
  const double cell = pixel * pixels_per_cell;
  const Eigen::Array2i first = ((runs.box().min().array() - pixel) / cell).floor().cast<int>(),
                       last = ((runs.box().max().array() + pixel) / cell).floor().cast<int>();
  pixels = {first * pixels_per_cell, (last + 1) * pixels_per_cell, pixel};
  planning::Mask mask(pixels.cells(), 0);
  runs.mark(pixels, false, mask);
  depth.assign(mask.begin(), mask.end());
  if (cap == 0) return;
  // The edge runs somewhere between the last point inside and the first outside.
  depth = pixels.depth_in(mask);
  for (float& one : depth)
    if (one > 0) one = std::min((one - 0.5F) * static_cast<float>(pixel), static_cast<float>(cap));
}

FootholdField::FootholdField(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const Gait& gait,
                             const FootholdField* before)
    : snapshot_(std::move(snapshot)),
      octree_(std::move(octree)),
      gait_(gait),
      R_walk_map_(upright(gait.contact.up)),
      leg_(LegBox::of(gait.sole)),
      surfaces_(level_surfaces(*snapshot_, gait.contact)),
      first_yaw_(before != nullptr ? before->first_yaw_ : edge_direction(surfaces_, step_yaw())),
      columns_(octree_, snapshot_, R_walk_map_.toRotationMatrix(), box_of(surfaces_).min().z() - below_ground,
               box_of(surfaces_).max().z() + gait.body.to_m + gait.max_up_m),
      unknown_(octree_, R_walk_map_.toRotationMatrix()),
      patches_(surfaces_.size() * static_cast<std::size_t>(headings())) {
  if (octree_.resolution() <= 0) return;
  if (before != nullptr && before->ground_)
    ground_ = before->ground_->next(snapshot_, octree_);
  else
    ground_.emplace(snapshot_, octree_, GroundRules{gait_.sole, gait_.contact, {}, true});
  if (before == nullptr) return;
  columns_.follow(before->columns_);
  const auto each = static_cast<std::size_t>(headings());
  for (std::size_t now = 0, was = 0; now < surfaces_.size(); ++now) {
    const Surface& surface = *surfaces_[now].surface;
    while (was < before->surfaces_.size() && before->surfaces_[was].surface->id < surface.id) ++was;
    if (was == before->surfaces_.size() || before->surfaces_[was].surface->id != surface.id ||
        !planning::same_outline(*before->surfaces_[was].surface, surface))
      continue;
    for (std::size_t heading = 0; heading < each; ++heading)
      patches_[now * each + heading].raster = before->patches_[was * each + heading].raster;
  }
}

ContactRegion FootholdField::region(const Ground& ground, const ContactShape& shape,
                                    std::optional<double> yaw_rad) const {
  ContactLimits limits = gait_.contact;
  limits.clearance_m = limits.obstacle_margin_m = limits.unknown_to_m = 0;
  return contact_region(*ground.surface, shape, yaw_rad, limits);
}

Foothold FootholdField::hold(const Surface& surface, const Eigen::Vector3d& at, double yaw_rad) const {
  if (ground_) return ground_->foothold(surface.id, at, yaw_rad);
  return foothold(surface, gait_.sole, at, yaw_rad, gait_.contact, &octree_, snapshot_.get());
}

std::optional<ContactRefusal> FootholdField::refused(PlaceId id) {
  if (holds_.size() < places_.size()) holds_.resize(places_.size());
  if (!holds_[id]) {
    const Place& place = places_[id];
    holds_[id] =
        hold(*surfaces_[place.surface].surface, R_walk_map_.inverse() * place.at, yaw(place.heading));
  }
  return holds_[id]->refused;
}

Footstep FootholdField::footstep(FootName foot, const Place& place, double yaw_rad) const {
  const Surface& surface = *surfaces_[place.surface].surface;
  const Foothold found = hold(surface, R_walk_map_.inverse() * place.at, yaw_rad);
  return {foot, surface.id, found.T_map_contact, yaw_rad, found.margin_m};
}

int FootholdField::nearest_heading(double yaw_rad) const {
  const double steps = std::round((yaw_rad - first_yaw_) / step_yaw());
  return static_cast<int>(wrapped(steps, headings()) + 0.5) % headings();
}

void FootholdField::make(std::size_t surface, int heading, PlaceGrid& patch) {
  const Ground& ground = surfaces_[surface];
  const auto yaw_rad = gait_.round_feet ? std::nullopt : std::optional(yaw(heading));
  if (!patch.raster)
    patch.raster =
        std::make_shared<const RegionRaster>(region(ground, gait_.sole, yaw_rad).polygons,
                                             ground.T_walk_surface, cell / pixels_per_cell, largest_margin);
  patch.cells.emplace(*patch.raster, not_computed);
}

std::int32_t FootholdField::best_of_cell(const PlaceGrid& patch, std::size_t surface, int heading, int cell_x,
                                         int cell_y) {
  struct Point {
    float depth;
    int off_middle;  ///< distance from the cell's middle
    std::size_t pixel;
  };
  const RegionRaster& raster = *patch.raster;
  constexpr std::array<int, pixels_per_cell> off_middle{2, 1, 1, 2};
  boost::container::static_vector<Point, pixels_per_cell * pixels_per_cell> points;
  for (int j = 0; j < pixels_per_cell; ++j)
    for (int i = 0; i < pixels_per_cell; ++i) {
      const std::size_t pixel =
          raster.pixels.index_of({cell_x * pixels_per_cell + i, cell_y * pixels_per_cell + j});
      if (const float depth = raster.depth[pixel]; depth > 0)
        points.push_back({depth, off_middle[i] + off_middle[j], pixel});
    }
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
    return std::tuple(-a.depth, a.off_middle, a.pixel) < std::tuple(-b.depth, b.off_middle, b.pixel);
  });
  for (const Point& point : points) {
    const Eigen::Vector2d at = raster.pixels.middle(point.pixel);
    Place place{{at.x(), at.y(), surfaces_[surface].height(at)},
                point.depth,
                0,
                static_cast<std::uint16_t>(surface),
                static_cast<std::uint16_t>(heading)};
    if (obstructed(place)) continue;
    place.cost = cost_of(place);
    places_.push_back(place);
    return static_cast<std::int32_t>(places_.size()) - 1;
  }
  return none;
}

bool FootholdField::obstructed(const Place& place) {
  if (gait_.contact.clearance_m <= 0) return false;
  const Eigen::Vector3d normal = surfaces_[place.surface].normal();
  const double yaw_rad = yaw(place.heading), margin = gait_.contact.obstacle_margin_m;
  const Eigen::Vector2d middle = place.at.head<2>() + Eigen::Rotation2Dd(yaw_rad) * leg_.middle;
  const Eigen::Vector2d rise = -normal.head<2>() / normal.z();
  const double ground = place.at.z() + rise.dot(middle - place.at.head<2>());
  return columns_.blocked({middle, yaw_rad, leg_.half_length + margin, leg_.half_width + margin,
                           ground + gait_.contact.obstacle_from_m, ground + gait_.contact.clearance_m, rise},
                          surfaces_[place.surface].surface->id);
}

float FootholdField::cost_of(const Place& place) const {
  const Surface& surface = *surfaces_[place.surface].surface;
  const Eigen::Isometry3d& T = surfaces_[place.surface].T_walk_surface;
  const Eigen::Vector3d uv1 =
      (T.inverse() * place.at).cwiseProduct(Eigen::Vector3d(1, 1, 0)) + Eigen::Vector3d::UnitZ();
  const double deviation = std::sqrt(std::max(0.0, uv1.dot(surface.covariance * uv1)));
  const double slope = std::acos(std::clamp(T.linear()(2, 2), -1.0, 1.0));
  double cost = gait_.costs.margin * std::max(0.0, 1 - place.margin / gait_.costs.good_margin_m) +
                gait_.costs.uncertainty * std::min(1.0, deviation / gait_.costs.uncertain_m);
  if (gait_.contact.max_slope_rad > 0) cost += gait_.costs.slope * slope / gait_.contact.max_slope_rad;
  return static_cast<float>(cost);
}

}  // namespace octosurf::footsteps
