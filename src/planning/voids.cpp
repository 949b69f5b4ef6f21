#include "planning/voids.hpp"

#include "planning/cell_grid.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace octosurf::planning {
namespace {

/// rad. Two standard deviations of a stored view, of 6 bits a coordinate (sensing/reading_code.hpp).
constexpr double view_error = 0.035;
/// Voxels. A crossing that the view's error leaves less certain is no evidence.
constexpr double farthest_off = 0.75;
/// Voxels: half of a void's least width, two voxels, less the d/4 by which the nearest cell may miss its
/// middle.
constexpr double least_radius = 0.75;
/// Voxels. Outlines close gaps up to h, five voxels by default.
constexpr double largest_radius = 8;
/// Of ranges: noise grows with their square, so a reading from so much farther off is twice as uncertain.
constexpr double much_farther = 1.3;  // classes of range are a factor of √2 apart

/// A reading of the surface, or the place where a ray passed its plane.
struct Place {
  Eigen::Vector2d at;
  double range;      ///< m, of the reading
  double error = 0;  ///< m, of where it passed
};

class Voids {
 public:
  Voids(const Surface& surface, const OccupancyView& octree)
      : surface_(surface), octree_(octree), d_(octree.resolution()) {}

  void mark(const IsOpen& is_open, const CellRaster& cells, Mask& voids) {
    collect();
    drop_uncertain_readings();
    Mask empty = cells.inside(surface_.polygons);
    for (const Place& reading : readings_)
      cells.for_each_within(reading.at, least_radius * d_, [&](std::size_t cell) { empty[cell] = 0; });
    for (const std::size_t cell : cells.marked(empty))
      if (is_open(cells.middle(cell))) passed_.push_back({cells.middle(cell), 0, d_ / 2});
    if (passed_.empty()) return;
    const CellGrid grid = binned(readings_);
    std::vector<float> radius(cells.cells(), -1), void_radius(cells.cells(), 0);
    for (const Place& passed : passed_)
      cells.for_each_within(passed.at, largest_radius * d_, [&](std::size_t cell) {
        if (empty[cell] == 0) return;
        if (radius[cell] < 0) radius[cell] = static_cast<float>(radius_about(cells.middle(cell), grid));
        if ((cells.middle(cell) - passed.at).norm() + passed.error <= radius[cell])
          void_radius[cell] = radius[cell];
      });
    for (std::size_t i = 0; i < void_radius.size(); ++i)
      if (void_radius[i] > 0)
        cells.for_each_within(cells.middle(i), void_radius[i] + d_ / 4,
                              [&](std::size_t cell) { voids[cell] = 1; });
  }

 private:
  /// The surface's readings, and where rays to readings behind it crossed the plane.
  void collect() {
    const double tolerance = std::max(d_, 3 * surface_.rms_m + d_ / 2);  // nearer: may be this face
    // Deeper crossings are too uncertain, even straight on.
    const double deepest = farthest_off * d_ / view_error;
    const Eigen::Isometry3d T_surface_map = surface_.T_map_surface.inverse();
    const auto add = [&](const OccupancyView::Voxel& voxel, const Eigen::AlignedBox2d& tile) {
      const Eigen::Vector3d p = T_surface_map * voxel.point;
      if ((p.head<2>().array() < tile.min().array()).any() ||
          (p.head<2>().array() >= tile.max().array()).any())
        return;  // another tile's
      if (voxel.surface == surface_.id) {
        readings_.push_back({p.head<2>(), voxel.range_m});
        return;
      }
      const Eigen::Vector3d view = T_surface_map.linear() * voxel.view;
      if (-p.z() < tolerance || !(view.z() > 0)) return;
      const double error = view_error * -p.z() / (view.z() * view.z());
      if (error > farthest_off * d_) return;
      passed_.push_back({(p - p.z() / view.z() * view).head<2>(), voxel.range_m, error});
    };
    for (const Eigen::AlignedBox2d& tile : tiles(deepest)) {
      Eigen::AlignedBox3d box;
      for (const double u : {tile.min().x() - d_, tile.max().x() + d_})
        for (const double v : {tile.min().y() - d_, tile.max().y() + d_})
          for (const double z : {-deepest - d_, tolerance + d_})
            box.extend(surface_.T_map_surface * Eigen::Vector3d(u, v, z));
      octree_.for_each_occupied(box,
                                [&](const OccupancyView::Voxel& voxel) { return add(voxel, tile), true; });
    }
  }

  /// Squares that hold the polygons and `margin` about them: so small that boxes about them hold little else,
  /// whatever the slope.
  std::vector<Eigen::AlignedBox2d> tiles(double margin) const {
    const double edge = 32 * d_;
    const auto index = [edge](double x) { return static_cast<std::int64_t>(std::floor(x / edge)); };
    std::vector<std::pair<std::int64_t, std::int64_t>> keys;
    for (const Polygon& polygon : surface_.polygons) {
      Eigen::AlignedBox2d box;
      for (const Eigen::Vector2d& p : polygon.outer) box.extend(p);
      for (std::int64_t y = index(box.min().y() - margin); y <= index(box.max().y() + margin); ++y)
        for (std::int64_t x = index(box.min().x() - margin); x <= index(box.max().x() + margin); ++x)
          keys.emplace_back(y, x);
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    std::vector<Eigen::AlignedBox2d> boxes;
    for (const auto& [y, x] : keys) {
      const Eigen::Vector2d low(edge * static_cast<double>(x), edge * static_cast<double>(y));
      boxes.emplace_back(low, low + Eigen::Vector2d::Constant(edge));
    }
    return boxes;
  }

  /// Far readings scatter beyond edges, into slots, where no nearer one replaces them: one does not count
  /// where a ray from much nearer passed.
  void drop_uncertain_readings() {
    if (readings_.empty()) return;
    const CellGrid grid = binned(readings_);
    std::vector<bool> dropped(readings_.size(), false);
    for (const Place& passed : passed_)
      grid.visit(box_about(passed.at, least_radius * d_), [&](std::uint32_t i) {
        if (readings_[i].range > much_farther * passed.range &&
            (readings_[i].at - passed.at).norm() <= least_radius * d_)
          dropped[i] = true;
      });
    std::size_t i = 0;
    std::erase_if(readings_, [&](const Place&) { return dropped[i++]; });
  }

  CellGrid binned(const std::vector<Place>& places) const {
    Eigen::AlignedBox2d box(Eigen::Vector2d::Zero());
    for (const Place& place : places) box.extend(place.at);
    CellGrid grid(box, d_);
    for (std::size_t i = 0; i < places.size(); ++i)
      grid.add(static_cast<std::uint32_t>(i), Eigen::AlignedBox2d(places[i].at));
    grid.finish();
    return grid;
  }
  static Eigen::AlignedBox2d box_about(const Eigen::Vector2d& at, double reach) {
    return {at - Eigen::Vector2d::Constant(reach), at + Eigen::Vector2d::Constant(reach)};
  }

  /// m: of the largest disc about a place without readings, up to the largest that counts.
  double radius_about(const Eigen::Vector2d& at, const CellGrid& grid) const {
    for (double reach = 2 * d_;; reach *= 2) {
      const double limit = std::min(reach, largest_radius * d_);
      double best = limit * limit;
      grid.visit(box_about(at, limit),
                 [&](std::uint32_t i) { best = std::min(best, (readings_[i].at - at).squaredNorm()); });
      if (best < limit * limit || limit < reach) return std::sqrt(best);
    }
  }

  const Surface& surface_;
  const OccupancyView& octree_;
  double d_;
  std::vector<Place> readings_, passed_;
};

}  // namespace

void mark_voids(const Surface& surface, const OccupancyView& octree, const IsOpen& is_open,
                const CellRaster& cells, Mask& voids) {
  Voids(surface, octree).mark(is_open, cells, voids);
}

}  // namespace octosurf::planning
