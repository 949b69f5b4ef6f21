#include "planning/storey_ground.hpp"

#include "planning/ground_tiles.hpp"
#include "planning/voxel_matter.hpp"

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::planning {
namespace {

constexpr int samples = 3;  // along a cell's edge: of 5 cm, less than a voxel of 2 cm apart
/// Voxels that must be free from a place down where the ground is open: as GroundPlane::depth().
constexpr int open_depth = 3;
/// Voxels: a lower pending reading may be ground, as in ground_patch().
constexpr float beside_ground = 1.5;
constexpr double most_places = 1 << 24;                       // as height_grid()
constexpr double steepest_rad = 80 * std::numbers::pi / 180;  // steeper ones have no height over a cell

/// Sorts by cell, then height. Returns the first of each cell, and the end.
template <class Item>
std::vector<std::uint32_t> sort_by_height(std::vector<Item>& items, std::size_t cells) {
  std::vector<std::uint32_t> first = sort_by_cell(items, cells, [](const Item& item) { return item.cell; });
  for (std::size_t cell = 0; cell < cells; ++cell)
    std::sort(items.begin() + first[cell], items.begin() + first[cell + 1],
              [](const Item& a, const Item& b) { return a.height < b.height; });
  return first;
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
  const double least_up = std::cos(std::min(view_.rules().limits.max_slope_rad, steepest_rad));
  std::set<SurfaceId> treads;
  for (const Stair& stair : view_.stairs().stairs) treads.insert(stair.treads.begin(), stair.treads.end());
  std::vector<std::pair<Eigen::Vector2i, GroundSpot>> ground;
  Eigen::AlignedBox2i box;
  for (const SurfacePtr& mapped : view_.mapped().surfaces) {
    const Plane plane{limits_.turn * mapped->plane.normal, mapped->plane.offset};
    if (treads.contains(mapped->id) || !(plane.normal.z() >= least_up)) continue;
    std::vector<std::tuple<int, int, bool>> cells;  // x, y, open
    view_.tiles_of(mapped->id)
        ->for_each_place(
            view_.octree(), limits_.cell_m / samples, [&](const Eigen::Vector2d& uv, Ground kind) {
              if (kind != Ground::supported && kind != Ground::open) return;
              const Eigen::Vector3d at = limits_.turn * mapped->to_map(uv);
              const Eigen::Array2i cell = (at.head<2>() / limits_.cell_m).array().floor().cast<int>();
              const std::tuple one(cell.x(), cell.y(), kind == Ground::open);
              if (cells.empty() || cells.back() != one) cells.push_back(one);
            });
    std::sort(cells.begin(), cells.end());
    planes_.push_back(plane);
    surfaces_.push_back(mapped->id);
    const auto surface = static_cast<std::uint32_t>(planes_.size() - 1);
    for (const auto& [x, y, open] : cells) {
      const Eigen::Vector2i cell(x, y);
      if (ground.empty() || ground.back().second.surface != surface || ground.back().first != cell)
        ground.push_back({cell, {0, 0, surface}});
      ground.back().second.open = open;  // the last, if any is
      box.extend(cell);
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
  sort_by_height(spots_, raster_->cells());
  // The highest within a step supports the robot.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < spots_.size(); ++i)
    if (i + 1 == spots_.size() || spots_[i + 1].cell != spots_[i].cell ||
        spots_[i + 1].height - spots_[i].height > step_)
      spots_[kept++] = spots_[i];
  spots_.resize(kept);
  for (GroundSpot& spot : spots_)  // drops beside an outline, too
    spot.open = spot.open || is_open_in(raster_->middle(spot.cell), spot.height);
  first_spot_ = sort_by_height(spots_, raster_->cells());
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
  first_seen_ = sort_by_height(seen_, raster_->cells());
}

/// Anywhere in a cell: free from a voxel above it to `open_depth` voxels below, or to other things two voxels
/// lower.
bool StoreyGround::is_open_in(const Eigen::Vector2d& middle, double height) const {
  using State = OccupancyView::State;
  const auto is_open = [&](const Eigen::Vector2d& at) {
    if (state_at(at, height + d_) == State::occupied) return false;
    for (int below = 0; below < open_depth; ++below) {
      const State state = state_at(at, height - below * d_);
      if (state != State::free) return below == open_depth - 1 && state == State::occupied;
    }
    return true;
  };
  for (int i = 0; i < samples * samples; ++i)
    if (is_open(middle +
                limits_.cell_m * ((Eigen::Array2d(i % samples, i / samples) + 0.5) / samples - 0.5).matrix()))
      return true;
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
