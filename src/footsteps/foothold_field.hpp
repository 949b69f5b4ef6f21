#pragma once

#include "footsteps/gait.hpp"
#include "footsteps/obstacle_columns.hpp"
#include "planning/cell_raster.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::footsteps {

/// Points of a raster along a side of a search cell.
inline constexpr int pixels_per_cell = 4;

/// Polygons of a plane rasterised from above: grid points inside them, with their distance from the rings.
struct RegionRaster {
  /// `T`: the polygons' (u, v) to the walking frame, of which x and y are used. Distances are capped at
  /// `cap`; 0: none are measured.
  RegionRaster(const std::vector<Polygon>& polygons, const Eigen::Isometry3d& T, double pixel, double cap);

  planning::CellRaster pixels;  ///< of whole search cells; none: no polygons
  /// m from the pixel's point to the nearest point outside, too small by up to a pixel; 0 outside.
  std::vector<float> depth;
};

/// A number for each search cell of a raster.
struct CellNumbers {
  CellNumbers(const RegionRaster& raster, std::int32_t number)
      : cells(raster.pixels.low() / pixels_per_cell, raster.pixels.high() / pixels_per_cell, 1),
        numbers(cells.cells(), number) {}
  std::int32_t& at(int x, int y) { return numbers[cells.index_of({x, y})]; }
  std::int32_t at(int x, int y) const { return numbers[cells.index_of({x, y})]; }

  planning::CellRaster cells;
  std::vector<std::int32_t> numbers;
};

/// A candidate foothold: the best of its cell.
struct Place {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< walking frame
  float margin = 0;                              ///< m, up to the raster's cap
  float cost = 0;                                ///< by StepCosts
  std::uint16_t surface = 0;                     ///< index into FootholdField::surfaces()
  std::uint16_t heading = 0;                     ///< 0 of round feet
};
using PlaceId = std::uint32_t;

/// The map prepared for one robot: the footholds of all surfaces that are level enough, in cells of 5 cm and
/// in 16 headings; computed on demand. Walking frame: the map turned upright.
///
/// Edges are evaluated by contact_region() for a surface and heading at once, obstacles for a cell by the
/// columns (a region with obstacles cut out takes seconds where a room's walls stand on its floor), and a
/// foothold that a plan would use finally by foothold().
class FootholdField {
 public:
  static constexpr double cell = 0.05;  ///< m; half a sole's width

  struct Ground {
    SurfacePtr surface;
    Eigen::Isometry3d T_walk_surface;
    Eigen::AlignedBox3d box;  ///< walking frame
    Eigen::Vector3d normal() const { return T_walk_surface.linear().col(2); }
    double height(const Eigen::Vector2d& at) const {
      return (normal().dot(T_walk_surface.translation()) - normal().head<2>().dot(at)) / normal().z();
    }
  };

  /// `before`: of an earlier snapshot of the same map, or nullptr.
  FootholdField(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const Gait& gait,
                const FootholdField* before);

  static constexpr int headings() {
    return WalkTable::headings;
  }  ///< 22.5° each: one a step, with the usual limit of 25°
  static constexpr double step_yaw() { return 2 * std::numbers::pi / headings(); }
  /// Yaw of a heading, walking frame.
  double yaw(int heading) const { return first_yaw_ + heading * step_yaw(); }
  int nearest_heading(double yaw_rad) const;

  const Snapshot& snapshot() const { return *snapshot_; }
  const std::vector<Ground>& surfaces() const { return surfaces_; }
  const Place& place(PlaceId id) const { return places_[id]; }
  ObstacleColumns& columns() { return columns_; }
  UnknownSpace& unknown() { return unknown_; }
  /// Contact region of a shape on a surface, without obstacles.
  ContactRegion region(const Ground& ground, const ContactShape& shape, std::optional<double> yaw_rad) const;
  /// foothold() of the robot; `at` in the map frame.
  Foothold hold(const Surface& surface, const Eigen::Vector3d& at, double yaw_rad) const;
  /// Why foothold() refuses it, if it does.
  std::optional<ContactRefusal> refused(PlaceId id);
  Footstep footstep(FootName foot, const Place& place, double yaw_rad) const;
  Standing to_map(const Standing& at) const { return {R_walk_map_.inverse() * at.at, at.yaw_rad}; }
  Standing to_walk(const Standing& at) const { return {R_walk_map_ * at.at, at.yaw_rad}; }

  /// Calls visit(id) for every place of a heading whose cell meets the box; by surface, row, column.
  template <class Visit>
  void for_each_place(int heading, const Eigen::AlignedBox2d& box, Visit&& visit) {
    if (gait_.round_feet) heading = 0;
    for (std::size_t s = 0; s < surfaces_.size(); ++s) {
      const Eigen::AlignedBox3d& around = surfaces_[s].box;
      if (around.min().x() > box.max().x() || around.max().x() < box.min().x() ||
          around.min().y() > box.max().y() || around.max().y() < box.min().y())
        continue;
      PlaceGrid& patch = patch_of(s, heading);
      const planning::CellRaster& cells = patch.cells->cells;
      const Eigen::Array2i low = cells.low().array().max((box.min().array() / cell).floor().cast<int>()),
                           end = cells.high().array().min((box.max().array() / cell).floor().cast<int>() + 1);
      for (int y = low.y(); y < end.y(); ++y)
        for (int x = low.x(); x < end.x(); ++x) {
          std::int32_t& id = patch.cells->at(x, y);
          if (id == not_computed) id = best_of_cell(patch, s, heading, x, y);
          if (id >= 0) visit(static_cast<PlaceId>(id));
        }
    }
  }

 private:
  static constexpr std::int32_t none = -1, not_computed = -2;
  struct PlaceGrid {
    std::shared_ptr<const RegionRaster> raster;  ///< empty: not made yet
    std::optional<CellNumbers> cells;            ///< places; likewise
  };
  PlaceGrid& patch_of(std::size_t surface, int heading) {
    PlaceGrid& patch =
        patches_[surface * static_cast<std::size_t>(headings()) + static_cast<std::size_t>(heading)];
    if (!patch.cells) make(surface, heading, patch);
    return patch;
  }
  void make(std::size_t surface, int heading, PlaceGrid& patch);
  std::int32_t best_of_cell(const PlaceGrid& patch, std::size_t surface, int heading, int x, int y);
  bool obstructed(const Place& place);
  float cost_of(const Place& place) const;

  std::shared_ptr<const Snapshot> snapshot_;
  OccupancyView octree_;
  const Gait gait_;
  std::optional<GroundView> ground_;  ///< of the outlines as given; empty without an octree
  Eigen::Quaterniond R_walk_map_;
  LegBox leg_;
  std::vector<Ground> surfaces_;
  double first_yaw_;
  ObstacleColumns columns_;
  UnknownSpace unknown_;
  std::vector<PlaceGrid> patches_;
  std::vector<Place> places_;
  std::vector<std::optional<Foothold>> holds_;  ///< by place; empty: not evaluated
};

}  // namespace octosurf::footsteps
