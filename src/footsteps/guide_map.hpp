#pragma once

#include "footsteps/foothold_field.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// A relaxed step graph without headings and shapes: cells of 10 cm where the largest disc inside a sole can
/// stand, connected if no farther than the longest step and no higher than the highest. Every step of the
/// robot is possible here, so a place unreachable here is unreachable. The path in metres avoids obstacles to
/// the trunk.
class GuideMap {
 public:
  GuideMap(FootholdField& field, const Gait& gait);

  /// Distances to all cells with one of these points (walking frame, surface).
  struct Target {
    Eigen::Vector3d at;
    std::uint16_t surface;
  };
  void aim(const std::vector<Target>& targets);

  /// Path length from a place to a target in m; infinite if there is no path.
  double metres(const Place& place) const;
  /// The point half a metre or slightly more ahead on the path from a place to the nearest target.
  Eigen::Vector2d ahead(const Place& place) const;

  /// Half the diagonal of the 2.5 cm between grid points: a disc smaller by this much fits at one of them
  /// wherever the sole fits.
  static constexpr double slack_m = 0.0177;

 private:
  static constexpr double cell = 0.10;
  struct Cell {
    int x = 0, y = 0;
    std::uint16_t surface = 0;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< of its points
    double low = 0, high = 0;                          ///< z of its points
  };
  struct Link {
    std::uint32_t from;  ///< cells with a step to this one
    float metres;
  };

  void add_cells(const RegionRaster& raster, std::size_t surface, FootholdField& field, const Gait& gait);
  void link(ObstacleColumns& columns, const Gait& gait);
  std::int32_t find(const Eigen::Vector3d& at, std::size_t surface) const;

  std::vector<Cell> cells_;
  std::vector<CellNumbers> grids_;         ///< by surface: index into cells_, or -1
  std::vector<std::uint32_t> first_link_;  ///< cells + 1
  std::vector<Link> links_;
  std::vector<float> metres_;
  std::vector<std::uint32_t> next_;  ///< next cell on the path, itself at a target
};

}  // namespace octosurf::footsteps
