#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::judgement {

/// Directions: the faces of a cube about the sensor, each in 64 × 64 cells of equal angles, 1.4°: a camera's
/// or a lidar's 8,000 readings are then two or more to a cell. Of a sparser sensor in fewer, larger ones.
using Cell = std::uint16_t;

/// At most 8,000 readings, evenly spread.
std::vector<Eigen::Vector3f> thinned(const std::vector<Eigen::Vector3f>& points);

/// A place that a view has seen.
struct Sample {
  Eigen::Vector3f point;   ///< view's frame
  float range = 0;         ///< m
  Eigen::Vector3f normal;  ///< of the readings around, if they are flat
  float scatter = 0;       ///< m, root mean square, of these about their plane
  float spread = 0;        ///< m, root mean square, of these along it
  bool known = false;      ///< there are enough of them
  bool flat = false;
};

/// What was seen from nearly one place: a scan, or lines of a tilting laser one after the other.
struct View {
  std::string name;        ///< of the first scan
  std::size_t scan = 0;    ///< its index in the recording
  std::size_t number = 0;  ///< of the view, among those compared
  bool camera = false;
  Eigen::Isometry3d T_map_view = Eigen::Isometry3d::Identity();  ///< the first scan's pose
  std::optional<Eigen::Isometry3d> T_map_before, T_map_after;    ///< of the scans beside that one
  std::vector<Eigen::Vector3f> points;                           ///< view's frame; by cell, once finished
  std::vector<Cell> cells;                                       ///< of the points
  std::vector<Sample> samples;                                   ///< at most 200
  float range = 0;                                               ///< m, median of the points
  int cells_of_edge = 0;                                         ///< by the spacing of the readings
  bool sparse = false;  ///< most readings have no neighbours in the largest cells

  /// Sorts the points and takes samples.
  void finish();
  Cell cell_of(const Eigen::Vector3f& direction) const;
  /// Calls f(point) for those in the cells up to `reach` cells around on the same face.
  template <class F>
  void around(Cell cell, int reach, const F& f) const {
    const int n = cells_of_edge;
    const int column = cell % n, row = cell / n % n, face = cell - column - n * row;
    const int left = std::max(0, column - reach), right = std::min(n - 1, column + reach);
    for (int r = std::max(0, row - reach); r <= std::min(n - 1, row + reach); ++r) {
      const int first = face + n * r + left, last = face + n * r + right;
      auto at = std::lower_bound(cells.begin(), cells.end(), static_cast<Cell>(first));
      for (; at != cells.end() && *at <= last; ++at) f(points[static_cast<std::size_t>(at - cells.begin())]);
    }
  }
  /// Where a scan later the point of the view would be, less where it is: m, map axes.
  Eigen::Vector3d motion_of(const Eigen::Vector3d& point) const;

 private:
  void sort_points();
};

}  // namespace octosurf::judgement
