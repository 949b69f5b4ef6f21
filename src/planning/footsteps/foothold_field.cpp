#include "planning/footsteps/foothold_field.hpp"

#include "planning/rings.hpp"

#include <algorithm>
#include <array>
#include <boost/container/static_vector.hpp>
#include <chrono>
#include <cmath>
#include <numbers>
#include <tuple>

#include <octosurf/up.hpp>

namespace octosurf::footsteps {
namespace {

constexpr double largest_margin = 0.06;  // m; beyond it the cell's middle is as good as any point

double wrapped(double angle, double period) { return angle - period * std::floor(angle / period); }

}  // namespace

double edge_direction(const std::vector<FootholdField::Ground>& surfaces, double period) {
  // Directions modulo `period` mapped to a circle, so that 0 and `period` coincide.
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const FootholdField::Ground& ground : surfaces) {
    for (const Polygon& polygon : simplified(*ground.surface)) {
      planning::for_each_edge(polygon, [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
        const Eigen::Vector2d along = (ground.T_walk_surface.linear().topLeftCorner<2, 2>() * (to - from));
        const double turn = 2 * std::numbers::pi * std::atan2(along.y(), along.x()) / period;
        // Squared, to favour the long edges of straight outlines over the many short ones of round outlines.
        sum += along.squaredNorm() * Eigen::Vector2d(std::cos(turn), std::sin(turn));
      });
    }
  }
  if (sum.norm() == 0) return 0;
  return wrapped(std::atan2(sum.y(), sum.x()) * period / (2 * std::numbers::pi), period);
}

ContactLimits without_obstacles(ContactLimits limits) {
  limits.clearance_m = limits.obstacle_margin_m = 0;
  return limits;
}

FootholdField::FootholdField(const Snapshot& snapshot, const ContactShape& shape, const ContactLimits& limits,
                             const OccupancyView& octree,
                             const std::map<SurfaceId, std::vector<PolygonEdges>>& edges,
                             ObstacleColumns& columns, const StepCosts& costs, int headings)
    : snapshot_(snapshot),
      shape_(shape),
      limits_(limits),
      octree_(octree),
      edges_(edges),
      columns_(columns),
      leg_(LegBox::of(shape)),
      costs_(costs),
      headings_(headings),
      step_yaw_(2 * std::numbers::pi / headings) {
  const Eigen::Quaterniond R_walk_map = upright(limits.up);
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if (slope_rad(*surface, limits.up) > limits.max_slope_rad) continue;
    Ground ground{surface, R_walk_map * surface->T_map_surface, {}};
    for (const Polygon& polygon : surface->polygons)
      for (const Eigen::Vector2d& uv : polygon.outer)
        ground.box.extend(ground.T_walk_surface * Eigen::Vector3d(uv.x(), uv.y(), 0));
    if (!ground.box.isEmpty()) surfaces_.push_back(std::move(ground));
  }
  patches_.resize(surfaces_.size() * static_cast<std::size_t>(headings_));
  if (headings_ > 1) first_yaw_ = edge_direction(surfaces_, step_yaw_);
}

int FootholdField::nearest_heading(double yaw_rad) const {
  const double steps = std::round((yaw_rad - first_yaw_) / step_yaw_);
  return static_cast<int>(wrapped(steps, headings_) + 0.5) % headings_;
}

void FootholdField::make(std::size_t surface, int heading, PlaceGrid& patch) {
  const auto start = std::chrono::steady_clock::now();
  const Ground& ground = surfaces_[surface];
  const auto labels = edges_.find(ground.surface->id);
  const std::optional<double> yaw_rad = headings_ > 1 ? std::optional(yaw(heading)) : std::nullopt;
  const ContactRegion region = contact_region(*ground.surface, shape_, yaw_rad, without_obstacles(limits_),
                                              nullptr, labels == edges_.end() ? nullptr : &labels->second);
  patch.raster.emplace(region.polygons, ground.T_walk_surface, cell / pixels_per_cell, largest_margin);
  if (!patch.raster->empty()) {
    const RegionRaster& raster = *patch.raster;
    patch.x = cell_of_pixel(raster.x0());
    patch.y = cell_of_pixel(raster.y0());
    patch.width = cell_of_pixel(raster.x0() + raster.width() - 1) - patch.x + 1;
    patch.height = cell_of_pixel(raster.y0() + raster.height() - 1) - patch.y + 1;
    patch.place_at.assign(static_cast<std::size_t>(patch.width) * static_cast<std::size_t>(patch.height),
                          not_computed);
  }
  build_ms_ += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

std::int32_t FootholdField::best_of_cell(const PlaceGrid& patch, std::size_t surface, int heading, int cell_x,
                                         int cell_y) {
  struct Point {
    float depth;
    int off_middle;  ///< distance from the cell's middle
    int x, y;
  };
  constexpr std::array<int, pixels_per_cell> off_middle{2, 1, 1, 2};
  boost::container::static_vector<Point, pixels_per_cell * pixels_per_cell> points;
  for (int j = 0; j < pixels_per_cell; ++j)
    for (int i = 0; i < pixels_per_cell; ++i) {
      const int x = cell_x * pixels_per_cell + i, y = cell_y * pixels_per_cell + j;
      const float depth = patch.raster->depth(x, y);
      if (depth > 0)
        points.push_back(
            {depth, off_middle[static_cast<std::size_t>(i)] + off_middle[static_cast<std::size_t>(j)], x, y});
    }
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
    return std::tuple(-a.depth, a.off_middle, a.y, a.x) < std::tuple(-b.depth, b.off_middle, b.y, b.x);
  });
  const Eigen::Isometry3d& T = surfaces_[surface].T_walk_surface;
  const Eigen::Vector3d normal = T.linear().col(2);
  for (const Point& point : points) {
    const Eigen::Vector2d at = Eigen::Vector2d(point.x + 0.5, point.y + 0.5) * patch.raster->pixel();
    const double z = (normal.dot(T.translation()) - normal.head<2>().dot(at)) / normal.z();
    Place place{{at.x(), at.y(), z},
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
  if (limits_.clearance_m <= 0) return false;
  const Eigen::Vector3d normal = T_walk_surface(place).linear().col(2);
  const double yaw_rad = yaw(place.heading), margin = limits_.obstacle_margin_m;
  const Eigen::Vector2d middle = place.at.head<2>() + Eigen::Rotation2Dd(yaw_rad) * leg_.middle;
  const Eigen::Vector2d rise = -normal.head<2>() / normal.z();
  const double ground = place.at.z() + rise.dot(middle - place.at.head<2>());
  return columns_.blocked({middle, yaw_rad, leg_.half_length + margin, leg_.half_width + margin,
                           ground + limits_.obstacle_from_m, ground + limits_.clearance_m, rise},
                          surface_of(place).id);
}

bool FootholdField::stands(PlaceId id) {
  if (stands_.size() < places_.size()) stands_.resize(places_.size());
  if (!stands_[id]) {
    const Place& place = places_[id];
    const Surface& surface = surface_of(place);
    const auto labels = edges_.find(surface.id);
    const Eigen::Vector3d at = surface.T_map_surface * (T_walk_surface(place).inverse() * place.at);
    stands_[id] = foothold(surface, shape_, at, yaw(place.heading), limits_, &octree_,
                           labels == edges_.end() ? nullptr : &labels->second, &snapshot_)
                      .accepted;
  }
  return *stands_[id];
}

float FootholdField::cost_of(const Place& place) const {
  const Surface& surface = surface_of(place);
  const Eigen::Isometry3d& T = T_walk_surface(place);
  const Eigen::Vector3d uv1 =
      (T.inverse() * place.at).cwiseProduct(Eigen::Vector3d(1, 1, 0)) + Eigen::Vector3d::UnitZ();
  const double deviation = std::sqrt(std::max(0.0, uv1.dot(surface.covariance * uv1)));
  const double slope = std::acos(std::clamp(T.linear()(2, 2), -1.0, 1.0));
  double cost = costs_.margin * std::max(0.0, 1 - place.margin / costs_.good_margin_m) +
                costs_.uncertainty * std::min(1.0, deviation / costs_.uncertain_m);
  if (limits_.max_slope_rad > 0) cost += costs_.slope * slope / limits_.max_slope_rad;
  return static_cast<float>(cost);
}

}  // namespace octosurf::footsteps
