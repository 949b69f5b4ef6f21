#include "planning/footsteps/obstacle_columns.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace octosurf::footsteps {

ObstacleColumns::ObstacleColumns(OccupancyView octree, const Eigen::Matrix3d& R_walk_map, double low,
                                 double high)
    : octree_(std::move(octree)),
      R_walk_map_(R_walk_map),
      low_(low),
      high_(high),
      pixel_(octree_.resolution()) {}

bool ObstacleColumns::blocked(const UprightBox& box, SurfaceId but) {
  if (pixel_ <= 0) return false;
  const double inflation = std::sqrt(3.0) / 2 * pixel_;
  Sought sought{box.center,
                box.rise,
                std::cos(box.yaw_rad),
                std::sin(box.yaw_rad),
                box.half_length + inflation,
                box.half_width + inflation,
                static_cast<float>(box.from_z - inflation),
                static_cast<float>(box.to_z + inflation),
                but,
                0,
                0,
                0,
                0};
  const double reach_x = std::abs(sought.cos) * sought.half_length + std::abs(sought.sin) * sought.half_width;
  const double reach_y = std::abs(sought.sin) * sought.half_length + std::abs(sought.cos) * sought.half_width;
  const auto pixel_of = [this](double v) { return static_cast<int>(std::floor(v / pixel_)); };
  sought.x0 = pixel_of(box.center.x() - reach_x);
  sought.x1 = pixel_of(box.center.x() + reach_x);
  sought.y0 = pixel_of(box.center.y() - reach_y);
  sought.y1 = pixel_of(box.center.y() + reach_y);
  // The lowest that the box's bottom is anywhere: a block that ends below it needs no look.
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

bool ObstacleColumns::blocked_in_block(const Tile& tile, int x0, int y0, const Sought& box) const {
  for (int y = std::max(y0, box.y0); y < y0 + block_pixels && y <= box.y1; ++y) {
    for (int x = std::max(x0, box.x0); x < x0 + block_pixels && x <= box.x1; ++x) {
      // Tiles are aligned to powers of two, so the low bits are the place in one, below zero as well.
      const int column = (y & (tile_pixels - 1)) * tile_pixels + (x & (tile_pixels - 1));
      const std::uint32_t begin = tile.begin[column], end = tile.begin[column + 1];
      if (begin == end) continue;
      const double dx = (x + 0.5) * pixel_ - box.center.x(), dy = (y + 0.5) * pixel_ - box.center.y();
      if (std::abs(box.cos * dx + box.sin * dy) > box.half_length) continue;
      if (std::abs(box.cos * dy - box.sin * dx) > box.half_width) continue;
      const auto lift = static_cast<float>(box.rise.x() * dx + box.rise.y() * dy);
      const auto begin_z = tile.z.begin();
      for (auto k = std::lower_bound(begin_z + begin, begin_z + end, box.from_z + lift) - begin_z;
           k < end && tile.z[k] <= box.to_z + lift; ++k)
        if (box.but == 0 || tile.surface[k] != box.but) return true;
    }
  }
  return false;
}

const ObstacleColumns::Tile& ObstacleColumns::tile(int tile_x, int tile_y) {
  const std::uint64_t key = static_cast<std::uint64_t>(static_cast<std::uint32_t>(tile_x)) << 32 |
                            static_cast<std::uint32_t>(tile_y);
  Recent& recent = recent_[static_cast<std::size_t>((tile_y & 7) * 8 + (tile_x & 7))];
  if (recent.tile != nullptr && recent.key == key) return *recent.tile;
  const auto found = tiles_.find(key);
  if (found != tiles_.end()) {
    recent = {key, &found->second};
    return found->second;
  }
  const auto start = std::chrono::steady_clock::now();
  const Tile& made = tiles_.emplace(key, load(tile_x, tile_y)).first->second;
  load_ms_ += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  recent = {key, &made};
  return made;
}

ObstacleColumns::Tile ObstacleColumns::load(int tile_x, int tile_y) const {
  const double edge = tile_pixels * pixel_;
  const Eigen::AlignedBox3d upright(Eigen::Vector3d(tile_x * edge, tile_y * edge, low_),
                                    Eigen::Vector3d((tile_x + 1) * edge, (tile_y + 1) * edge, high_));
  Eigen::AlignedBox3d box;  // map frame
  for (int corner = 0; corner < 8; ++corner)
    box.extend(R_walk_map_.transpose() *
               upright.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  std::vector<std::tuple<std::uint32_t, float, SurfaceId>> found;
  octree_.for_each_occupied(box, [&](const OccupancyView::Voxel& voxel) {
    const Eigen::Vector3d at = R_walk_map_ * voxel.center;
    const int x = static_cast<int>(std::floor(at.x() / pixel_)) - tile_x * tile_pixels;
    const int y = static_cast<int>(std::floor(at.y() / pixel_)) - tile_y * tile_pixels;
    if (x < 0 || y < 0 || x >= tile_pixels || y >= tile_pixels) return true;
    found.emplace_back(static_cast<std::uint32_t>(y * tile_pixels + x), static_cast<float>(at.z()),
                       voxel.surface);
    return true;
  });
  std::sort(found.begin(), found.end());
  Tile result;
  result.begin.assign(tile_pixels * tile_pixels + 1, 0);
  result.top.assign(tile_blocks * tile_blocks, -std::numeric_limits<float>::infinity());
  for (const auto& [column, z, surface] : found) {
    float& top =
        result.top[column / tile_pixels / block_pixels * tile_blocks + column % tile_pixels / block_pixels];
    top = std::max(top, z);
    ++result.begin[column + 1];
    result.z.push_back(z);
    result.surface.push_back(surface);
  }
  for (std::size_t i = 1; i < result.begin.size(); ++i) result.begin[i] += result.begin[i - 1];
  return result;
}

}  // namespace octosurf::footsteps
