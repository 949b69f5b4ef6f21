#include "planning/ground_readings.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/ground_patch.hpp>

namespace octosurf {
namespace {

using namespace planning;

constexpr float cell_m = GroundReadings::cell_m;
constexpr double farthest_m = 5;       ///< of a point from the base
constexpr float first_ground_m = 0.5;  ///< from the base to the nearest ground seen, beside the robot's feet

/// A cell's ground, and the content of its middle.
struct Flooded {
  float ground = no_height;
  Look look;
};

/// Not beyond ground higher than the headroom above the base: too little is read over it.
std::vector<Flooded> flood(const GroundReadings& readings, float max_step, float headroom) {
  std::vector<Flooded> cells(readings.cells());
  std::size_t start = cells.size();
  float nearest = first_ground_m, height = no_height;
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const float distance = readings.middle(cell).norm();
    if (distance >= nearest) continue;
    const float below = readings.highest_below_base(cell);
    if (std::isnan(below)) continue;
    start = cell;
    nearest = distance;
    height = below;
  }
  // Continued ground before places beyond its end.
  std::deque<std::pair<std::size_t, float>> next;
  if (start < cells.size()) next.emplace_back(start, height);
  while (!next.empty()) {
    const auto [cell, from] = next.front();
    next.pop_front();
    Flooded& here = cells[cell];
    if (!std::isnan(here.ground)) continue;
    here.look = readings.look(readings.middle(cell), from);
    const bool continues =
        std::fabs(here.look.height - from) <= max_step && here.look.height <= headroom;  // NaN fails
    here.ground = continues ? here.look.height : from;
    readings.for_each_near(cell, 1, [&, ground = here.ground](std::size_t other) {
      if (!std::isnan(cells[other].ground)) return;
      if (continues)
        next.emplace_front(other, ground);
      else
        next.emplace_back(other, ground);
    });
  }
  return cells;
}

/// m, from the middle of each cell to where the ground ends or a step begins that no slope explains.
std::vector<float> distances_to_ends(const GroundReadings& readings, const std::vector<Flooded>& cells,
                                     const GroundView& view) {
  const auto most =
      static_cast<float>(view.octree().resolution() +
                         std::numbers::sqrt2 * cell_m * std::tan(view.rules().limits.max_slope_rad));
  const auto is_end = [&](std::size_t cell) {
    bool end = false;
    readings.for_each_near(cell, 1, [&](std::size_t other) {
      end = end || std::fabs(cells[other].look.height - cells[cell].look.height) > most;
    });
    return end;
  };
  std::vector<float> distances(cells.size(), static_cast<float>(Foothold::farthest_margin_m));
  std::deque<std::pair<std::size_t, std::size_t>> next;  // a cell, and the end nearest to it
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const bool supported = cells[cell].look.cell == PatchCell::supported;
    if (supported && !is_end(cell)) continue;
    distances[cell] = supported ? 0 : -cell_m / 2;
    next.emplace_back(cell, cell);
  }
  while (!next.empty()) {
    const auto [cell, end] = next.front();
    next.pop_front();
    const float beyond = cells[end].look.cell == PatchCell::supported ? 0 : cell_m / 2;
    readings.for_each_near(cell, 1, [&, end = end](std::size_t other) {
      const float distance = (readings.middle(other) - readings.middle(end)).norm() - beyond;
      if (distance >= distances[other]) return;
      distances[other] = distance;
      next.emplace_back(other, end);
    });
  }
  return distances;
}

void require(const Eigen::Isometry3d& T_map_base, const PatchLayout& layout) {
  require_rigid(T_map_base, "T_map_base");
  const auto refuse = [](const char* what, const char* is, const char* hint) {
    throw Error(Error::Kind::usage, what, is, hint);
  };
  if (layout.points.empty()) refuse("layout.points", "are none", "give some, as PatchLayout::grid() does");
  for (const Eigen::Vector2d& point : layout.points)
    if (!(point.norm() <= farthest_m))
      refuse("layout.points", "has one farther than 5 m", "give nearer ones");
  if (!(layout.max_step_m > 0 && layout.max_step_m <= 1))
    refuse("layout.max_step_m", "must be in (0, 1]", "give the robot's highest step");
  if (!(layout.headroom_m > layout.max_step_m && layout.headroom_m <= 5))
    refuse("layout.headroom_m", "must be above max_step_m and at most 5", "give the robot's height");
}

/// At the base, z along up, x above the base's.
Eigen::Isometry3d yaw_frame(const Eigen::Isometry3d& T_map_base, const Eigen::Vector3d& up) {
  Eigen::Isometry3d T = T_map_base;
  const Eigen::Vector3d z = up.normalized();
  Eigen::Vector3d y = z.cross(T_map_base.linear().col(0));
  if (!(y.norm() > 1e-6)) y = T_map_base.linear().col(1) - z.dot(T_map_base.linear().col(1)) * z;
  y.normalize();
  T.linear() << y.cross(z), y, z;
  return T;
}

void fill_in(const std::vector<Eigen::Vector2d>& points, std::vector<float>& heights) {
  const std::vector<float> known = heights;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!std::isnan(known[i])) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < points.size(); ++k)
      if (const double off = (points[k] - points[i]).squaredNorm(); off < nearest && !std::isnan(known[k])) {
        nearest = off;
        heights[i] = known[k];
      }
  }
}

}  // namespace

PatchLayout PatchLayout::grid(double length_m, double width_m, double cell_m, const Eigen::Vector2d& center) {
  const double nx = std::round(length_m / cell_m), ny = std::round(width_m / cell_m);
  if (!(nx >= 1 && ny >= 1 && nx * ny <= 1e5))
    throw Error(Error::Kind::usage, "cell_m", "does not divide the patch into 1 to 100,000 cells",
                "give another size");
  PatchLayout layout;
  for (double x = 0; x < nx; ++x)
    for (double y = 0; y < ny; ++y)
      layout.points.push_back(center + cell_m * Eigen::Vector2d(x - (nx - 1) / 2, y - (ny - 1) / 2));
  return layout;
}

GroundPatch ground_patch(const GroundView& view, const Eigen::Isometry3d& T_map_base,
                         const PatchLayout& layout) {
  require(T_map_base, layout);
  const Eigen::Isometry3d T_map_patch = yaw_frame(T_map_base, view.rules().limits.up);
  const auto max_step = static_cast<float>(layout.max_step_m),
             headroom = static_cast<float>(layout.headroom_m);
  // Ground is seldom higher than the base: obstacles over such ground are read only when some is found.
  std::optional<GroundReadings> read;
  std::vector<Flooded> cells;
  for (const float highest : {0.0F, headroom}) {
    read.emplace(view, T_map_patch, layout, highest);
    cells = flood(*read, max_step, headroom);
    if (std::ranges::none_of(cells, [&](const Flooded& cell) { return cell.ground > highest; })) break;
  }
  const GroundReadings& readings = *read;
  const std::vector<float> to_end = distances_to_ends(readings, cells, view);
  GroundPatch patch;
  const std::size_t n = layout.points.size();
  patch.height.reserve(n), patch.cell.reserve(n), patch.slope_rad.reserve(n), patch.edge_m.reserve(n);
  for (const Eigen::Vector2d& point : layout.points) {
    const Eigen::Vector2f place = point.cast<float>();
    const std::size_t at = readings.cell_at(place);
    Look look = cells[at].look;
    if ((readings.middle(at) - place).norm() > 1e-3F && !std::isnan(cells[at].ground))
      look = readings.look(place, cells[at].ground);
    look = readings.without_edge(look, place);
    patch.height.push_back(look.height);
    patch.cell.push_back(look.cell);
    patch.slope_rad.push_back(look.slope_rad);
    patch.edge_m.push_back(look.cell == PatchCell::supported ? std::max(0.0F, to_end[at]) : 0);
  }
  if (layout.fill) fill_in(layout.points, patch.height);
  return patch;
}

}  // namespace octosurf
