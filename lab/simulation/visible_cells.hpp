#pragma once

#include "evaluation/truth.hpp"
#include "simulation/sensor.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace octosurf::simulation {

/// One byte grid per face over its bounds, in which seen cells are marked.
class VisibleCells {
 public:
  VisibleCells(const std::vector<evaluation::TrueFace>& faces, const SensorModel& sensor);

  /// Marks where a scan's noise-free readings lie (Readings of recording.hpp); see
  /// Recording::Visibility for what counts between pixels.
  void add(const Eigen::Isometry3d& T_map_sensor, std::span<const float> t,
           std::span<const std::uint16_t> labels);

  /// The faces with `visible` and `visible_area_m2`: marked cells whose centre lies in the polygons.
  std::vector<evaluation::TrueFace> faces() const;

 private:
  struct Grid {
    int column = 0, row = 0;  ///< of the first cell
    int columns = 0, rows = 0;
    std::vector<std::uint8_t> seen;
    void mark(const Eigen::Vector2f& cell);
  };
  void fill(const Eigen::Vector2f& here, const Eigen::Vector2f& right, const Eigen::Vector2f& below,
            Grid& grid);

  std::vector<evaluation::TrueFace> faces_;
  SensorModel sensor_;
  std::vector<Grid> grids_;
};

}  // namespace octosurf::simulation
