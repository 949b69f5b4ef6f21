#include "footsteps/guide_map.hpp"

#include "geometry/interruption.hpp"
#include "geometry/voxel_key.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::footsteps {
namespace {

constexpr double cut_m = 1000;  // added where the trunk cannot pass: longer than any detour
constexpr float nowhere = std::numeric_limits<float>::infinity();

// Level distance between the nearest points of two cells that many columns or rows apart.
double gap(int columns, double cell) { return std::max(0, std::abs(columns) - 1) * cell; }

}  // namespace

GuideMap::GuideMap(FootholdField& field, const Gait& gait) {
  const ContactShape disc = ContactShape::disc(std::max(0.001, gait.disc_radius_m - slack_m));
  for (std::size_t s = 0; s < field.surfaces().size(); ++s) {
    const FootholdField::Ground& ground = field.surfaces()[s];
    add_cells(
        {field.region(ground, disc, std::nullopt).polygons, ground.T_walk_surface, cell / pixels_per_cell, 0},
        s, field, gait);
  }
  link(field.columns(), gait);
}

void GuideMap::add_cells(const RegionRaster& raster, std::size_t surface, FootholdField& field,
                         const Gait& gait) {
  CellNumbers& grid = grids_.emplace_back(raster, -1);
  const FootholdField::Ground& ground = field.surfaces()[surface];
  const double wide = gait.trunk_reach_m;
  // Points between grid points may be lower or higher.
  const double slack = cell / pixels_per_cell * ground.normal().head<2>().norm() / ground.normal().z();
  for (std::size_t i = 0; i < grid.numbers.size(); ++i) {
    geometry::end_if_interrupted();
    const Eigen::Vector2i place = grid.cells.place_of(i);
    Cell made{place.x(), place.y(), static_cast<std::uint16_t>(surface), {0, 0}, HUGE_VAL, -HUGE_VAL};
    int count = 0;
    for (int k = 0; k < pixels_per_cell * pixels_per_cell; ++k) {
      const std::size_t pixel = raster.pixels.index_of(
          pixels_per_cell * place + Eigen::Vector2i(k % pixels_per_cell, k / pixels_per_cell));
      if (raster.depth[pixel] == 0) continue;
      const Eigen::Vector2d at = raster.pixels.middle(pixel);
      const double z = ground.height(at);
      if (wide > 0 && field.columns().blocked({at, 0, wide, wide, z + gait.body.from_m, z + gait.body.to_m}))
        continue;
      made.middle += at;
      made.low = std::min(made.low, z);
      made.high = std::max(made.high, z);
      ++count;
    }
    if (count == 0) continue;
    made.middle /= count;
    made.low -= slack;
    made.high += slack;
    grid.numbers[i] = static_cast<std::int32_t>(cells_.size());
    cells_.push_back(made);
  }
}

void GuideMap::link(ObstacleColumns& columns, const Gait& gait) {
  const double farthest = gait.reach_m + 2 * slack_m;
  const int around = static_cast<int>(farthest / cell) + 1;  // rows whose nearest points are near enough
  tsl::robin_map<std::uint64_t, bool, geometry::PackedKeyHash>
      known;  // by column, row, height: whether the trunk collides
  const auto is_blocked = [&](int x, int y, double ground) {
    const auto [found, made] =
        known.try_emplace(geometry::packed_cell({x, y, static_cast<int>(std::floor(ground / cell))}));
    if (made)
      found.value() = columns.blocked({Eigen::Vector2d((x + 0.5) * cell, (y + 0.5) * cell), 0, cell / 2,
                                       cell / 2, ground + gait.body.from_m, ground + gait.body.to_m});
    return found.value();
  };
  // A step may cross a thin wall, or lead under a bridge; the trunk cannot.
  const auto is_cut = [&](const Cell& from, const Cell& to) {
    const int dx = to.x - from.x, dy = to.y - from.y, parts = std::max(std::abs(dx), std::abs(dy));
    const auto between = [&](int start, int way, int i) {
      return start + static_cast<int>(std::lround(static_cast<double>(i * way) / parts));
    };
    for (int i = 1; i < parts; ++i)
      if (is_blocked(between(from.x, dx, i), between(from.y, dy, i), std::max(from.low, to.low))) return true;
    return false;
  };
  std::vector<std::size_t> near;  // grids within reach of that of the surface at hand, whose cells follow
  std::size_t surface = grids_.size();
  for (const Cell& to : cells_) {
    geometry::end_if_interrupted();
    if (std::exchange(surface, to.surface) != to.surface) {
      near.clear();
      const Eigen::AlignedBox2i here(grids_[surface].cells.low().array() - around,
                                     grids_[surface].cells.high().array() + around);
      for (std::size_t i = 0; i < grids_.size(); ++i)
        if (here.intersects(Eigen::AlignedBox2i(grids_[i].cells.low(), grids_[i].cells.high())))
          near.push_back(i);
    }
    first_link_.push_back(static_cast<std::uint32_t>(links_.size()));
    for (const std::size_t k : near) {
      const CellNumbers& grid = grids_[k];
      const Eigen::Vector2i &first = grid.cells.low(), end = grid.cells.high();
      for (int y = std::max(to.y - around, first.y()); y < std::min(to.y + around + 1, end.y()); ++y) {
        const double left = farthest * farthest - std::pow(gap(y - to.y, cell), 2);
        const int beside = static_cast<int>(std::sqrt(left) / cell) + 1;
        for (int x = std::max(to.x - beside, first.x()); x < std::min(to.x + beside + 1, end.x()); ++x) {
          if (grid.at(x, y) < 0) continue;
          const auto i = static_cast<std::uint32_t>(grid.at(x, y));
          const Cell& from = cells_[i];
          if (to.low - from.high > gait.max_up_m || from.low - to.high > gait.max_down_m) continue;
          const double metres = (from.middle - to.middle).norm();
          links_.push_back(
              {i, static_cast<float>(gait.trunk_reach_m > 0 && is_cut(from, to) ? metres + cut_m : metres)});
        }
      }
    }
  }
  first_link_.push_back(static_cast<std::uint32_t>(links_.size()));
}

void GuideMap::aim(const std::vector<Target>& targets) {
  metres_.assign(cells_.size(), nowhere);
  next_.resize(cells_.size());
  std::iota(next_.begin(), next_.end(), 0U);
  using Entry = std::pair<float, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const Target& target : targets) {
    const std::int32_t i = find(target.at, target.surface);
    if (i < 0 || metres_[static_cast<std::size_t>(i)] == 0) continue;
    const auto cell_index = static_cast<std::uint32_t>(i);
    metres_[cell_index] = 0;
    queue.emplace(0.0F, cell_index);
  }
  while (!queue.empty()) {
    const auto [distance, to] = queue.top();
    queue.pop();
    if (distance > metres_[to]) continue;
    for (std::uint32_t k = first_link_[to]; k < first_link_[to + 1]; ++k) {
      const float sum = distance + links_[k].metres;
      if (sum >= metres_[links_[k].from]) continue;
      metres_[links_[k].from] = sum;
      next_[links_[k].from] = to;
      queue.emplace(sum, links_[k].from);
    }
  }
}

Eigen::Vector2d GuideMap::ahead(const Place& place) const {
  constexpr double far_enough = 0.5;  // m: in nearer cells the grid's directions dominate
  const std::int32_t here = find(place.at, place.surface);
  if (here < 0) return Eigen::Vector2d::Zero();
  auto at = static_cast<std::uint32_t>(here);
  while (next_[at] != at && (cells_[at].middle - place.at.head<2>()).norm() < far_enough) at = next_[at];
  return cells_[at].middle - place.at.head<2>();
}

std::int32_t GuideMap::find(const Eigen::Vector3d& at, std::size_t surface) const {
  const CellNumbers& grid = grids_[surface];
  const auto cell_at = [&](double x, double y) {
    const Eigen::Vector2i place(static_cast<int>(std::floor(x / cell)),
                                static_cast<int>(std::floor(y / cell)));
    return grid.cells.holds(place) ? grid.numbers[grid.cells.index_of(place)] : -1;
  };
  if (const std::int32_t here = cell_at(at.x(), at.y()); here >= 0) return here;
  for (const double dx : {-slack_m, 0.0, slack_m})  // the nearest grid point may be this far off
    for (const double dy : {-slack_m, 0.0, slack_m})
      if (const std::int32_t beside = cell_at(at.x() + dx, at.y() + dy); beside >= 0) return beside;
  return -1;
}

double GuideMap::metres(const Place& place) const {
  const std::int32_t i = find(place.at, place.surface);
  return i < 0 ? nowhere : metres_[static_cast<std::size_t>(i)];
}

}  // namespace octosurf::footsteps
