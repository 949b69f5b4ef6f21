#include "footsteps/obstacle_columns.hpp"

#include "geometry/voxel_key.hpp"
#include "occupancy/cubes.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace octosurf::footsteps {

ObstacleColumns::ObstacleColumns(OccupancyView octree, std::shared_ptr<const Snapshot> surfaces,
                                 const Eigen::Matrix3d& R_walk_map, double low, double high)
    : octree_(std::move(octree)),
      surfaces_(std::move(surfaces)),
      R_walk_map_(R_walk_map),
      low_(low),
      high_(high),
      pixel_(octree_.resolution()) {
  // To whole voxels, so that surfaces that settle do not change them.
  if (pixel_ > 0) low_ = std::floor(low / pixel_) * pixel_, high_ = std::ceil(high / pixel_) * pixel_;
}

void ObstacleColumns::follow(const ObstacleColumns& before) {
  if (before.pixel_ != pixel_ || pixel_ <= 0 || before.low_ != low_ || before.high_ != high_) return;
  const double edge = tile_pixels * pixel_, beside = planning::MatterOfVoxels::farthest_move + pixel_;
  std::unordered_set<std::uint64_t> stale;
  for (const Eigen::AlignedBox3d& cube : occupancy::changed_cubes(before.octree_, octree_)) {
    const Eigen::Vector3d middle = R_walk_map_ * cube.center(),
                          reach = (R_walk_map_.cwiseAbs() * cube.sizes() / 2).array() + beside;
    const Eigen::Array2i from = ((middle - reach).head<2>() / edge).array().floor().cast<int>(),
                         to = ((middle + reach).head<2>() / edge).array().floor().cast<int>();
    for (int y = from.y(); y <= to.y(); ++y)
      for (int x = from.x(); x <= to.x(); ++x) stale.insert(geometry::packed_cell({x, y, 0}));
  }
  const auto is_same = [&](const Voxel& one) {
    return before.surfaces_->find(one.surface) == surfaces_->find(one.surface);
  };
  for (const auto& [key, tile] : before.tiles_)
    if (!stale.contains(key) && std::ranges::all_of(tile.voxels, is_same)) tiles_.emplace(key, tile);
}

bool ObstacleColumns::blocked(const UprightBox& box, SurfaceId but) {
  if (pixel_ <= 0) return false;
  // A voxel that reaches into the box has its middle within this distance of it, and within that of its
  // pixel's box.
  const double reach = planning::MatterOfVoxels::farthest_reach * pixel_,
               off_pixel = std::sqrt(2.0) / 2 * pixel_;
  const double slope = box.rise.norm();
  Sought sought;
  sought.box = box;
  sought.ahead = {std::cos(box.yaw_rad), std::sin(box.yaw_rad)};
  sought.left = {-sought.ahead.y(), sought.ahead.x()};
  const Eigen::Matrix3d R_map_walk = R_walk_map_.transpose();
  sought.ahead_in_map = R_map_walk.leftCols<2>() * sought.ahead;
  sought.left_in_map = R_map_walk.leftCols<2>() * sought.left;
  sought.over_bottom_in_map = R_map_walk * Eigen::Vector3d(-box.rise.x(), -box.rise.y(), 1);
  sought.half_length = box.half_length + reach + off_pixel;
  sought.half_width = box.half_width + reach + off_pixel;
  const double over_bottom = reach * std::hypot(1, slope) + slope * off_pixel;
  sought.from_z = static_cast<float>(box.from_z - over_bottom);
  sought.to_z = static_cast<float>(box.to_z + over_bottom);
  sought.but = but;
  const double length = box.half_length + reach, width = box.half_width + reach;
  const double reach_x = std::abs(sought.ahead.x()) * length + std::abs(sought.ahead.y()) * width;
  const double reach_y = std::abs(sought.ahead.y()) * length + std::abs(sought.ahead.x()) * width;
  const auto pixel_of = [this](double v) { return static_cast<int>(std::floor(v / pixel_)); };
  sought.x0 = pixel_of(box.center.x() - reach_x);
  sought.x1 = pixel_of(box.center.x() + reach_x);
  sought.y0 = pixel_of(box.center.y() - reach_y);
  sought.y1 = pixel_of(box.center.y() + reach_y);
  // The lowest point of the box's bottom: blocks that end below it are skipped.
  const auto bottom = sought.from_z - static_cast<float>(std::abs(box.rise.x()) * (reach_x + pixel_) +
                                                         std::abs(box.rise.y()) * (reach_y + pixel_));
  const auto floor_to = [](int pixel, int step) {
    return (pixel >= 0 ? pixel / step : ~(~pixel / step)) * step;
  };
  for (int y = floor_to(sought.y0, block_pixels); y <= sought.y1; y += block_pixels) {
    const int tile_y = floor_to(y, tile_pixels) / tile_pixels;
    const Tile* here = nullptr;
    for (int x = floor_to(sought.x0, block_pixels), tile_x = 0; x <= sought.x1; x += block_pixels) {
      if (here == nullptr || x >= (tile_x + 1) * tile_pixels) {
        tile_x = floor_to(x, tile_pixels) / tile_pixels;
        here = &tile(tile_x, tile_y);
      }
      const int block =
          (y - tile_y * tile_pixels) / block_pixels * tile_blocks + (x - tile_x * tile_pixels) / block_pixels;
      if (here->top[static_cast<std::size_t>(block)] >= bottom && blocked_in_block(*here, x, y, sought))
        return true;
    }
  }
  return false;
}

bool ObstacleColumns::blocked_in_block(const Tile& tile, int x0, int y0, const Sought& sought) const {
  const UprightBox& box = sought.box;
  for (int y = std::max(y0, sought.y0); y < y0 + block_pixels && y <= sought.y1; ++y) {
    for (int x = std::max(x0, sought.x0); x < x0 + block_pixels && x <= sought.x1; ++x) {
      // Tiles are aligned to powers of two, so the low bits are the place in one, also below zero.
      const int column = (y & (tile_pixels - 1)) * tile_pixels + (x & (tile_pixels - 1));
      const std::uint32_t begin = tile.begin[column], end = tile.begin[column + 1];
      if (begin == end) continue;
      const Eigen::Vector2d off = Eigen::Vector2d(x + 0.5, y + 0.5) * pixel_ - box.center;
      if (std::abs(sought.ahead.dot(off)) > sought.half_length) continue;
      if (std::abs(sought.left.dot(off)) > sought.half_width) continue;
      const auto lift = static_cast<float>(box.rise.dot(off));
      const Voxel* voxel = tile.voxels.data() + begin;
      const Voxel* const last = tile.voxels.data() + end;
      while (voxel != last && voxel->z < sought.from_z + lift) ++voxel;  // columns are short
      for (; voxel != last && voxel->z <= sought.to_z + lift; ++voxel)
        if ((sought.but == 0 || voxel->surface != sought.but) && reaches(voxel->matter, sought)) return true;
    }
  }
  return false;
}

bool ObstacleColumns::reaches(const planning::VoxelMatter& matter, const Sought& sought) const {
  const UprightBox& box = sought.box;
  const Eigen::Vector2d off = matter.middle.head<2>() - box.center;
  const double ahead = std::abs(sought.ahead.dot(off)) - box.half_length;
  const double left = std::abs(sought.left.dot(off)) - box.half_width;
  const double z = matter.middle.z() - box.rise.dot(off), over = std::max(box.from_z - z, z - box.to_z);
  // Usually its middle is in the box, or it is far off.
  if (std::max({ahead, left, over}) <= 0) return true;
  return ahead <= matter.reach(sought.ahead_in_map) && left <= matter.reach(sought.left_in_map) &&
         over <= matter.reach(sought.over_bottom_in_map);
}

const ObstacleColumns::Tile& ObstacleColumns::tile(int tile_x, int tile_y) {
  const std::uint64_t key = geometry::packed_cell({tile_x, tile_y, 0});
  Recent& recent = recent_[static_cast<std::size_t>((tile_y & 7) * 8 + (tile_x & 7))];
  if (recent.tile != nullptr && recent.key == key) return *recent.tile;
  const auto found = tiles_.find(key);
  if (found != tiles_.end()) {
    recent = {key, &found->second};
    return found->second;
  }
  const Tile& made = tiles_.emplace(key, load(tile_x, tile_y)).first->second;
  recent = {key, &made};
  return made;
}

ObstacleColumns::Tile ObstacleColumns::load(int tile_x, int tile_y) const {
  const double edge = tile_pixels * pixel_;
  const Eigen::AlignedBox3d upright(Eigen::Vector3d(tile_x * edge, tile_y * edge, low_),
                                    Eigen::Vector3d((tile_x + 1) * edge, (tile_y + 1) * edge, high_));
  // A voxel of a plane is moved onto the plane.
  const Eigen::AlignedBox3d box =
      planning::box_about(upright.transformed(Eigen::Isometry3d(R_walk_map_.transpose())),
                          planning::MatterOfVoxels::farthest_move);
  Tile result;
  planning::MatterOfVoxels matter_of(surfaces_.get(), pixel_);
  octree_.for_each_occupied(box, [&](const OccupancyView::Voxel& voxel) {
    planning::VoxelMatter one = matter_of(voxel);
    one.middle = R_walk_map_ * one.middle;
    const int x = static_cast<int>(std::floor(one.middle.x() / pixel_)) - tile_x * tile_pixels;
    const int y = static_cast<int>(std::floor(one.middle.y() / pixel_)) - tile_y * tile_pixels;
    if (x < 0 || y < 0 || x >= tile_pixels || y >= tile_pixels) return true;
    result.voxels.push_back({static_cast<std::uint32_t>(y * tile_pixels + x),
                             static_cast<float>(one.middle.z()), voxel.surface, one});
    return true;
  });
  // Stable: in the octree's order where they are equal.
  std::stable_sort(result.voxels.begin(), result.voxels.end(), [](const Voxel& a, const Voxel& b) {
    return std::tuple(a.column, a.z, a.surface) < std::tuple(b.column, b.z, b.surface);
  });
  result.begin.assign(tile_pixels * tile_pixels + 1, 0);
  result.top.assign(tile_blocks * tile_blocks, -std::numeric_limits<float>::infinity());
  for (const Voxel& one : result.voxels) {
    float& top = result.top[one.column / tile_pixels / block_pixels * tile_blocks +
                            one.column % tile_pixels / block_pixels];
    top = std::max(top, one.z);
    ++result.begin[one.column + 1];
  }
  for (std::size_t i = 1; i < result.begin.size(); ++i) result.begin[i] += result.begin[i - 1];
  return result;
}

}  // namespace octosurf::footsteps
