#pragma once

#include "planning/footsteps/obstacle_columns.hpp"
#include "planning/footsteps/region_raster.hpp"
#include "planning/footsteps/swing.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::footsteps {

/// A candidate foothold: the best of its cell.
struct Place {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< walking frame
  float margin = 0;                              ///< m, up to the raster's cap
  float cost = 0;                                ///< by StepCosts
  std::uint16_t surface = 0;                     ///< index into FootholdField::surfaces()
  std::uint16_t heading = 0;
};
using PlaceId = std::uint32_t;

/// The footholds of all surfaces that are level enough, in cells of 5 cm and in 16 headings; computed on
/// demand. Walking frame: the map turned upright.
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
  };

  /// `headings` 1: for a shape without heading. Refers to `snapshot`, `octree`, `edges` and `columns`.
  FootholdField(const Snapshot& snapshot, const ContactShape& shape, const ContactLimits& limits,
                const OccupancyView& octree, const std::map<SurfaceId, std::vector<PolygonEdges>>& edges,
                ObstacleColumns& columns, const StepCosts& costs, int headings);

  int headings() const { return headings_; }
  /// Yaw of a heading, walking frame.
  double yaw(int heading) const { return first_yaw_ + heading * step_yaw_; }
  double step_yaw() const { return step_yaw_; }
  int nearest_heading(double yaw_rad) const;

  const std::vector<Ground>& surfaces() const { return surfaces_; }
  const Place& place(PlaceId id) const { return places_[id]; }
  const Surface& surface_of(const Place& place) const { return *surfaces_[place.surface].surface; }
  /// Whether foothold() accepts it.
  bool stands(PlaceId id);
  const Eigen::Isometry3d& T_walk_surface(const Place& place) const {
    return surfaces_[place.surface].T_walk_surface;
  }

  /// Calls visit(id) for every place of a heading whose cell meets the box; by surface, row, column.
  template <class Visit>
  void for_each_place(int heading, const Eigen::AlignedBox2d& box, Visit&& visit) {
    for (std::size_t s = 0; s < surfaces_.size(); ++s) {
      const Eigen::AlignedBox3d& around = surfaces_[s].box;
      if (around.min().x() > box.max().x() || around.max().x() < box.min().x() ||
          around.min().y() > box.max().y() || around.max().y() < box.min().y())
        continue;
      PlaceGrid& patch = patch_of(s, heading);
      const int x0 = std::max(patch.x, cell_of(box.min().x())),
                x1 = std::min(patch.x + patch.width - 1, cell_of(box.max().x()));
      const int y0 = std::max(patch.y, cell_of(box.min().y())),
                y1 = std::min(patch.y + patch.height - 1, cell_of(box.max().y()));
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
          std::int32_t& id =
              patch.place_at[static_cast<std::size_t>(y - patch.y) * patch.width + x - patch.x];
          if (id == not_computed) id = best_of_cell(patch, s, heading, x, y);
          if (id >= 0) visit(static_cast<PlaceId>(id));
        }
    }
  }

  double build_ms() const { return build_ms_; }  ///< spent on regions so far

 private:
  static constexpr std::int32_t none = -1, not_computed = -2;
  struct PlaceGrid {
    std::optional<RegionRaster> raster;       ///< empty: not made yet
    int x = 0, y = 0, width = 0, height = 0;  ///< cells
    std::vector<std::int32_t> place_at;       ///< by row
  };
  static int cell_of(double v) { return static_cast<int>(std::floor(v / cell)); }
  PlaceGrid& patch_of(std::size_t surface, int heading) {
    PlaceGrid& patch =
        patches_[surface * static_cast<std::size_t>(headings_) + static_cast<std::size_t>(heading)];
    if (!patch.raster) make(surface, heading, patch);
    return patch;
  }
  void make(std::size_t surface, int heading, PlaceGrid& patch);
  std::int32_t best_of_cell(const PlaceGrid& patch, std::size_t surface, int heading, int x, int y);
  bool obstructed(const Place& place);
  float cost_of(const Place& place) const;

  const Snapshot& snapshot_;
  ContactShape shape_;
  ContactLimits limits_;
  const OccupancyView& octree_;
  const std::map<SurfaceId, std::vector<PolygonEdges>>& edges_;
  ObstacleColumns& columns_;
  LegBox leg_;
  StepCosts costs_;
  int headings_;
  double first_yaw_ = 0, step_yaw_;
  std::vector<Ground> surfaces_;
  std::vector<PlaceGrid> patches_;
  std::vector<Place> places_;
  std::vector<std::optional<bool>> stands_;  ///< by place; empty: not evaluated
  double build_ms_ = 0;
};

/// `limits` without those that need the octree.
ContactLimits without_obstacles(ContactLimits limits);

/// The main direction, in [0, `period`), of the surfaces' edges, weighted by length: buildings have few
/// directions, and a sole aligned with a tread needs less of it. Walking frame.
double edge_direction(const std::vector<FootholdField::Ground>& surfaces, double period);

}  // namespace octosurf::footsteps
