#include "planning/storey_ground.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <numbers>
#include <queue>
#include <set>
#include <utility>
#include <variant>

namespace octosurf {
namespace {

using namespace planning;

/// Divides ground into connected parts that have one height in each cell. Returns how many there are.
std::uint32_t divide(StoreyGround& ground) {
  std::vector<GroundSpot>& spots = ground.spots();
  std::vector<std::uint32_t> taken(ground.raster().cells(), GroundSpot::none), by_height;
  for (std::uint32_t i = 0; i < spots.size(); ++i)
    if (!spots[i].open) by_height.push_back(i);
  const auto lower = [&spots](std::uint32_t a, std::uint32_t b) {
    return std::pair(spots[a].height, a) < std::pair(spots[b].height, b);
  };
  std::sort(by_height.begin(), by_height.end(), lower);
  const auto higher = [&](std::uint32_t a, std::uint32_t b) { return lower(b, a); };
  std::uint32_t parts = 0;
  for (const std::uint32_t lowest : by_height) {
    if (spots[lowest].part != GroundSpot::none) continue;
    std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, decltype(higher)> rising(higher);
    for (rising.push(lowest); !rising.empty();) {
      GroundSpot& spot = spots[rising.top()];
      rising.pop();
      if (spot.part != GroundSpot::none || taken[spot.cell] == parts) continue;
      taken[spot.cell] = spot.part = parts;
      ground.for_each_next(spot, [&](const GroundSpot& next) {
        if (next.part == GroundSpot::none) rising.push(static_cast<std::uint32_t>(&next - spots.data()));
      });
    }
    ++parts;
  }
  return parts;
}

/// The part that holds a landing.
std::uint32_t part_at(const StoreyGround& ground, const Eigen::Vector3d& landing,
                      const StoreyLimits& limits) {
  std::uint32_t part = GroundSpot::none;
  double nearest = std::numeric_limits<double>::infinity();
  ground.raster().for_each_within(landing.head<2>(), limits.radius_m + limits.cell_m, [&](std::size_t cell) {
    const double off = (ground.raster().middle(cell) - landing.head<2>()).norm();
    ground.for_each_in(cell, [&](const GroundSpot& spot) {
      if (spot.part == GroundSpot::none || off >= nearest ||
          std::fabs(spot.height - landing.z()) > limits.max_step_m)
        return;
      nearest = off;
      part = spot.part;
    });
  });
  return part;
}

/// Each cell's elevation, or that of the nearest with one.
std::vector<float> spread(const CellRaster& grid, std::vector<float> heights) {
  std::deque<std::size_t> next;
  for (std::size_t cell = 0; cell < heights.size(); ++cell)
    if (!std::isnan(heights[cell])) next.push_back(cell);
  for (; !next.empty(); next.pop_front())
    grid.for_each_beside(next.front(), [&](std::size_t cell) {
      if (!std::isnan(heights[cell])) return;
      heights[cell] = heights[next.front()];
      next.push_back(cell);
    });
  return heights;
}

/// Ground becomes occupied where it is too narrow, or beyond a wall, over which outlines reach.
void close_narrow(const CellRaster& grid, Storey& storey, double radius_m) {
  Mask passable(grid.cells()), reached(grid.cells());
  const auto is_free = [&](std::size_t cell) { return storey.cells[cell] == StoreyCell::free; };
  for (std::size_t cell = 0; cell < grid.cells(); ++cell)
    passable[cell] = storey.cells[cell] != StoreyCell::occupied;
  const double radius = radius_m / storey.cell_m;
  const Mask middles = grid.eroded(passable, radius);
  for (std::size_t cell = 0; cell < grid.cells(); ++cell)
    if (middles[cell] != 0 && is_free(cell) && reached[cell] == 0)
      grid.connected(cell, reached, is_free, [](std::size_t) {});
  const std::vector<float> to_disc = grid.distance_to(middles);
  for (std::size_t cell = 0; cell < grid.cells(); ++cell)
    // Distance of a right-angled corner from the centre of a disc in it.
    if (is_free(cell) &&
        (reached[cell] == 0 || static_cast<double>(to_disc[cell]) > std::numbers::sqrt2 * radius))
      storey.cells[cell] = StoreyCell::occupied;
}

Storey storey_of(const StoreyGround& ground, std::uint32_t part, const StoreyLimits& limits) {
  const CellRaster& all = ground.raster();
  std::vector<const GroundSpot*> spots;
  Eigen::AlignedBox2i box;
  for (const GroundSpot& spot : ground.spots())
    if (spot.part == part) {
      spots.push_back(&spot);
      box.extend(all.place_of(spot.cell));
    }
  const Eigen::Vector2i low = box.min().array() - ground.margin(),
                        high = box.max().array() + ground.margin() + 1;
  const CellRaster grid(low, high, limits.cell_m);
  Storey storey;
  storey.cell_m = limits.cell_m;
  storey.origin = limits.cell_m * low.cast<double>();
  storey.columns = grid.width();
  storey.rows = grid.cells() / grid.width();
  storey.elevation.assign(grid.cells(), std::numeric_limits<float>::quiet_NaN());
  std::set<SurfaceId> surfaces;
  for (const GroundSpot* spot : spots) {
    storey.elevation[grid.cell_at(all.middle(spot->cell))] = spot->height;
    surfaces.insert(ground.surface(*spot));
  }
  storey.surfaces.assign(surfaces.begin(), surfaces.end());
  const auto median = spots.begin() + static_cast<std::ptrdiff_t>(spots.size() / 2);
  std::nth_element(spots.begin(), median, spots.end(),
                   [](const GroundSpot* a, const GroundSpot* b) { return a->height < b->height; });
  storey.height_m = (*median)->height;
  const std::vector<float> heights = spread(grid, storey.elevation);
  for (std::size_t cell = 0; cell < grid.cells(); ++cell)
    storey.cells.push_back(ground.look(all.cell_at(grid.middle(cell)), part, heights[cell]));
  close_narrow(grid, storey, limits.radius_m);
  storey.area_m2 =
      limits.cell_m * limits.cell_m *
      static_cast<double>(std::count(storey.cells.begin(), storey.cells.end(), StoreyCell::free));
  return storey;
}

/// A storey and the part of the ground that it is.
struct Found {
  std::uint32_t part;
  Storey storey;
};

/// Keeps the widest place of each seam.
void add_seams(const StoreyGround& ground, std::vector<Found>& found) {
  std::map<std::pair<std::size_t, std::size_t>, std::pair<float, Eigen::Vector3d>> widest;
  std::vector<std::vector<float>> room;
  std::map<std::uint32_t, std::size_t> index;
  for (const Found& one : found) {
    index[one.part] = room.size();
    room.push_back(room_in(one.storey));
  }
  for (const GroundSpot& spot : ground.spots())
    ground.for_each_next(spot, [&](const GroundSpot& next) {
      const auto from = index.find(spot.part), to = index.find(next.part);
      if (from == to || from == index.end() || to == index.end()) return;
      const Eigen::Vector2d at = ground.raster().middle(spot.cell);
      const float wide = room[from->second][*found[from->second].storey.cell_at(at)];
      auto& best =
          widest.try_emplace({from->second, to->second}, -1.0F, Eigen::Vector3d::Zero()).first->second;
      if (wide > best.first) best = {wide, {at.x(), at.y(), spot.height}};
    });
  for (const auto& [pair, best] : widest) found[pair.first].storey.seams[pair.second] = best.second;
}

}  // namespace

StoreyLimits StoreyLimits::of(const Robot& robot) {
  const BodyBox& body = std::visit([](const auto& kind) -> const BodyBox& { return kind.body; }, robot);
  StoreyLimits limits;
  limits.radius_m = std::hypot(body.length_m, body.width_m) / 2;
  limits.headroom_m = body.to_m;
  return limits;
}

std::optional<std::size_t> Storey::cell_at(const Eigen::Vector2d& point) const {
  const Eigen::Array2d at = ((point - origin) / cell_m).array().floor();
  if (!(at >= 0).all() || !(at.x() < static_cast<double>(columns)) || !(at.y() < static_cast<double>(rows)))
    return {};
  return static_cast<std::size_t>(at.y()) * columns + static_cast<std::size_t>(at.x());
}

std::vector<Storey> find_storeys(const GroundView& view, const StoreyLimits& limits) {
  require(limits);
  StoreyGround ground(view, limits);
  std::vector<double> ground_m2(divide(ground), 0);
  if (ground_m2.empty()) return {};
  for (const GroundSpot& spot : ground.spots())
    if (spot.part != GroundSpot::none) ground_m2[spot.part] += limits.cell_m * limits.cell_m;
  std::set<std::uint32_t> always{
      static_cast<std::uint32_t>(std::max_element(ground_m2.begin(), ground_m2.end()) - ground_m2.begin())};
  for (const Stair& stair : view.stairs().stairs)
    for (const bool above : {false, true})
      if (const auto landing = landing_of(stair, above, limits))
        always.insert(part_at(ground, *landing, limits));
  std::vector<Found> found;
  for (std::uint32_t part = 0; part < ground_m2.size(); ++part) {
    if (!always.contains(part) && ground_m2[part] < limits.min_area_m2) continue;
    Storey storey = storey_of(ground, part, limits);
    if (storey.area_m2 > 0 && (always.contains(part) || storey.area_m2 >= limits.min_area_m2))
      found.push_back({part, std::move(storey)});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Found& a, const Found& b) { return a.storey.height_m < b.storey.height_m; });
  add_seams(ground, found);
  std::vector<Storey> storeys;
  storeys.reserve(found.size());
  for (Found& one : found) storeys.push_back(std::move(one.storey));
  return storeys;
}

}  // namespace octosurf
