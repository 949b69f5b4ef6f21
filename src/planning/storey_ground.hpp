#pragma once

#include "planning/cell_raster.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <octosurf/ground.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/storeys.hpp>

namespace octosurf::planning {

/// Throws Error(usage) for limits out of range.
void require(const StoreyLimits& limits);

/// Of a stair's edge: its middle in the grids' frame.
Eigen::Vector3d middle_of(const Step& step, const StoreyLimits& limits);

/// Where a robot stands before or after climbing a stair: on its landing, a radius from the edge. Empty
/// without a seen landing.
std::optional<Eigen::Vector3d> landing_of(const Stair& stair, bool above, const StoreyLimits& limits);

/// Cells from each to the nearest that is occupied; 0 where a cell is not free.
std::vector<float> room_in(const Storey& storey);

/// A cell of a level surface. Heights are in the grids' frame.
struct GroundSpot {
  std::uint32_t cell;
  float height;           ///< in the middle
  std::uint32_t surface;  ///< index
  bool open = false;      ///< a void or a drop is in the cell
  std::uint32_t part = none;

  static constexpr std::uint32_t none = ~std::uint32_t{0};
};

/// All ground of a map except treads, and the readings, in cells of one raster.
class StoreyGround {
 public:
  /// Keeps both.
  StoreyGround(const GroundView& view, const StoreyLimits& limits);

  const CellRaster& raster() const { return *raster_; }
  std::vector<GroundSpot>& spots() { return spots_; }  ///< by cell, ascending; at most one within a step
  const std::vector<GroundSpot>& spots() const { return spots_; }
  SurfaceId surface(const GroundSpot& spot) const { return surfaces_[spot.surface]; }
  int margin() const { return margin_; }  ///< cells of the raster about all ground

  /// Calls `visit(next)` for the spots beside one that are reached without a step.
  template <class Visit>
  void for_each_next(const GroundSpot& spot, const Visit& visit) const {
    if (spot.open) return;
    const auto width = static_cast<std::uint32_t>(raster_->width());
    for (const std::uint32_t cell : {spot.cell - width, spot.cell - 1, spot.cell + 1, spot.cell + width}) {
      const Eigen::Vector2d border = (raster_->middle(spot.cell) + raster_->middle(cell)) / 2;
      for (std::uint32_t i = first_spot_[cell]; i < first_spot_[cell + 1]; ++i)
        if (!spots_[i].open && is_level(spot, spots_[i], border)) visit(spots_[i]);
    }
  }
  /// Calls `visit(spot)` for those of a cell.
  template <class Visit>
  void for_each_in(std::size_t cell, const Visit& visit) const {
    for (std::uint32_t i = first_spot_[cell]; i < first_spot_[cell + 1]; ++i) visit(spots_[i]);
  }
  /// State of a cell of a part, or of one beside it whose nearest ground has this height. Free cells may be
  /// too narrow for the robot.
  StoreyCell look(std::size_t cell, std::uint32_t part, float ground) const;

 private:
  struct Seen {
    std::uint32_t cell;
    float height;
    bool pending;
  };
  void add_surfaces();
  void add_readings();
  double height_at(std::uint32_t surface, const Eigen::Vector2d& at) const {
    const Plane& plane = planes_[surface];
    return (plane.offset - plane.normal.head<2>().dot(at)) / plane.normal.z();
  }
  bool is_level(const GroundSpot& a, const GroundSpot& b, const Eigen::Vector2d& at) const {
    return std::fabs(height_at(a.surface, at) - height_at(b.surface, at)) <= limits_.max_step_m;
  }
  OccupancyView::State state_at(const Eigen::Vector2d& at, double height) const {
    return view_.octree().at(from_grid_ * Eigen::Vector3d(at.x(), at.y(), height)).state;
  }
  bool is_open_in(const Eigen::Vector2d& middle, double height) const;
  bool is_blocked(std::size_t cell, float ground, float from, bool pending_too) const;

  const GroundView& view_;
  const StoreyLimits& limits_;
  Eigen::Quaterniond from_grid_;
  double d_;
  float step_;
  int margin_ = 0;
  std::vector<Plane> planes_;  // grids' frame
  std::vector<SurfaceId> surfaces_;
  std::unique_ptr<CellRaster> raster_;
  std::vector<GroundSpot> spots_;
  std::vector<Seen> seen_;
  std::vector<std::uint32_t> first_spot_, first_seen_;  // by cell, and the end
};

}  // namespace octosurf::planning
