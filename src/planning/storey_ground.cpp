#include "planning/storey_ground.hpp"

#include "planning/rings.hpp"
#include "planning/voxel_matter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/height_grid.hpp>

namespace octosurf::planning {
namespace {

constexpr int samples = 3;  // along a cell's edge: of 5 cm, less than a voxel of 2 cm apart
/// Voxels that must be free from a place down where the ground is open: as GroundPlane::depth().
constexpr int open_depth = 3;
/// Voxels: a lower pending reading may be ground, as in ground_patch().
constexpr float beside_ground = 1.5;
constexpr double most_places = 1 << 24;  // as height_grid()
/// Of a height grid, which has no height over a wall.
constexpr double steepest_rad = 80 * std::numbers::pi / 180;

using Cells = std::vector<std::pair<int, int>>;  // x and y, ascending

/// The first of each cell in a vector sorted by cells, and the end.
template <class Item>
std::vector<std::uint32_t> firsts(const std::vector<Item>& items, std::size_t cells) {
  std::vector<std::uint32_t> first(cells + 1, 0);
  for (const Item& item : items) ++first[item.cell + 1];
  for (std::size_t cell = 0; cell < cells; ++cell) first[cell + 1] += first[cell];
  return first;
}

template <class Item>
void sort_by_cell(std::vector<Item>& items) {
  std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.height < b.height;
  });
}

}  // namespace

StoreyGround::StoreyGround(const GroundView& view, const StoreyLimits& limits)
    : view_(view),
      limits_(limits),
      from_grid_(limits.turn.inverse()),
      d_(view.octree().resolution()),
      step_(static_cast<float>(limits.max_step_m)) {
  add_surfaces();
  add_readings();
}

void StoreyGround::add_surfaces() {
  std::set<SurfaceId> treads;
  for (const Stair& stair : view_.stairs().stairs) treads.insert(stair.treads.begin(), stair.treads.end());
  HeightGridOptions options;
  options.cell = limits_.cell_m / samples;
  options.turn = limits_.turn;
  options.max_slope_rad = std::min(view_.rules().limits.max_slope_rad, steepest_rad);
  const auto cells_of = [&](const SurfacePtr& surface) {  // with any sample in its polygons
    Snapshot one;
    one.resolution = d_;
    one.surfaces = {surface};
    const HeightGrid grid = height_grid(one, options);
    Cells cells;
    for (Eigen::Index column = 0; column < grid.elevation.cols(); ++column)
      for (Eigen::Index row = 0; row < grid.elevation.rows(); ++row)
        if (!std::isnan(grid.elevation(row, column))) {
          const Eigen::Array2d cell = (grid.center_of(row, column) / limits_.cell_m).array().floor();
          cells.emplace_back(static_cast<int>(cell.x()), static_cast<int>(cell.y()));
        }
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
  };
  std::vector<std::pair<Eigen::Vector2i, GroundSpot>> ground;
  Eigen::AlignedBox2i box;
  for (const SurfacePtr& mapped : view_.mapped().surfaces) {
    if (treads.contains(mapped->id)) continue;
    const Cells cells = cells_of(view_.solid(mapped->id));
    if (cells.empty()) continue;
    std::vector<Polygon> voids;
    for (const Gap& gap : view_.gaps(mapped->id))
      if (gap.kind == Ground::open) voids.push_back(gap.outline);
    Cells open;
    if (!voids.empty()) open = cells_of(with_outline(*mapped, std::move(voids)));
    planes_.push_back({limits_.turn * mapped->plane.normal, mapped->plane.offset});
    surfaces_.push_back(mapped->id);
    const auto surface = static_cast<std::uint32_t>(planes_.size() - 1);
    for (const auto& [x, y] : cells) {
      ground.push_back(
          {{x, y}, {0, 0, surface, std::binary_search(open.begin(), open.end(), std::pair(x, y))}});
      box.extend(ground.back().first);
    }
  }
  if (box.isEmpty()) box.extend(Eigen::Vector2i(0, 0));
  // As far beyond the ground as the robot's disc reaches from it.
  margin_ = static_cast<int>(std::ceil(limits_.radius_m / limits_.cell_m)) + 1;
  const Eigen::Vector2i low = box.min().array() - margin_, high = box.max().array() + margin_ + 1;
  if ((high - low).cast<double>().prod() > most_places)
    throw Error(Error::Kind::usage, "cell_m", "gives more than 2^24 cells", "give a larger one");
  raster_ = std::make_unique<CellRaster>(low, high, limits_.cell_m);
  for (auto& [cell, spot] : ground) {
    const Eigen::Vector2d middle = limits_.cell_m * (cell.cast<double>().array() + 0.5);
    spot.cell = static_cast<std::uint32_t>(raster_->cell_at(middle));
    spot.height = static_cast<float>(height_at(spot.surface, middle));
    spots_.push_back(spot);
  }
  sort_by_cell(spots_);
  // The highest within a step supports the robot.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < spots_.size(); ++i)
    if (i + 1 == spots_.size() || spots_[i + 1].cell != spots_[i].cell ||
        spots_[i + 1].height - spots_[i].height > step_)
      spots_[kept++] = spots_[i];
  spots_.resize(kept);
  for (GroundSpot& spot : spots_)
    spot.open = spot.open || is_open_in(raster_->middle(spot.cell), spot.height);
  first_spot_ = firsts(spots_, raster_->cells());
}

void StoreyGround::add_readings() {
  MatterOfVoxels matter_of(&view_.mapped(), d_);
  const Eigen::AlignedBox2d box = raster_->box();
  constexpr double far = std::numeric_limits<double>::max();
  view_.octree().for_each_occupied(
      {Eigen::Vector3d::Constant(-far), Eigen::Vector3d::Constant(far)},
      [&](const OccupancyView::Voxel& voxel) {
        const Eigen::Vector3d at = limits_.turn * matter_of(voxel).middle;
        if (box.contains(at.head<2>().eval()))
          seen_.push_back({static_cast<std::uint32_t>(raster_->cell_at(at.head<2>())),
                           static_cast<float>(at.z()), voxel.surface == 0});
        return true;
      });
  sort_by_cell(seen_);
  first_seen_ = firsts(seen_, raster_->cells());
}

/// Free from a voxel above a place to `open_depth` voxels below, or to other things two voxels lower.
bool StoreyGround::is_open(const Eigen::Vector2d& at, double height) const {
  using State = OccupancyView::State;
  if (state_at(at, height + d_) == State::occupied) return false;
  for (int below = 0; below < open_depth; ++below) {
    const State state = state_at(at, height - below * d_);
    if (state != State::free) return below == open_depth - 1 && state == State::occupied;
  }
  return true;
}

bool StoreyGround::is_open_in(const Eigen::Vector2d& middle, double height) const {
  for (int x = 0; x < samples; ++x)
    for (int y = 0; y < samples; ++y) {
      const Eigen::Vector2d off = limits_.cell_m * ((Eigen::Array2d(x, y) + 0.5) / samples - 0.5);
      if (is_open(middle + off, height)) return true;
    }
  return false;
}

/// By something read from more than `from` above the ground up to the headroom.
bool StoreyGround::is_blocked(std::size_t cell, float ground, float from, bool pending_too) const {
  const auto headroom = static_cast<float>(limits_.headroom_m);
  for (std::uint32_t i = first_seen_[cell]; i < first_seen_[cell + 1]; ++i) {
    const float above = seen_[i].height - ground;
    const bool low = above <= from;
    if (above <= headroom &&
        (!low || (pending_too && seen_[i].pending && above > beside_ground * static_cast<float>(d_))))
      return true;
  }
  return false;
}

StoreyCell StoreyGround::look(std::size_t cell, std::uint32_t part, float ground) const {
  const float beside = beside_ground * static_cast<float>(d_);
  for (std::uint32_t i = first_spot_[cell]; i < first_spot_[cell + 1]; ++i) {
    const GroundSpot& spot = spots_[i];
    if (spot.open && std::fabs(spot.height - ground) <= step_) return StoreyCell::occupied;
    if (spot.part == part)
      return is_blocked(cell, spot.height, step_, true) ? StoreyCell::occupied : StoreyCell::free;
  }
  if (is_blocked(cell, ground, beside, false)) return StoreyCell::occupied;
  const Eigen::Vector2d middle = raster_->middle(cell);
  const bool lower = first_seen_[cell] < first_seen_[cell + 1] &&
                     seen_[first_seen_[cell]].height < ground - std::max(step_, beside);
  if ((lower && state_at(middle, ground) == OccupancyView::State::free) || is_open_in(middle, ground))
    return StoreyCell::occupied;
  return StoreyCell::unknown;
}

}  // namespace octosurf::planning
