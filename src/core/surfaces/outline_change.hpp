#pragma once

#include "geometry/outline.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {

/// A surface's outline, for the thread that makes its polygons.
struct SharedOutline {
  explicit SharedOutline(double alpha) : outline(alpha) {}
  geometry::Outline outline;
  std::vector<Polygon> polygons;  ///< as of the last update, in cells
  bool broken = false;            ///< an update failed
};

/// What has changed in a surface's outline: it may be applied later, and by another thread.
struct OutlineChange {
  struct Cell {
    geometry::PlaneCell cell;
    std::uint32_t sites;  ///< number of those it has now
  };
  SurfaceId id = 0;
  std::shared_ptr<SharedOutline> outline;
  Eigen::Affine2d T_surface_outline;   ///< from cells to (u, v)
  std::vector<Cell> cells;             ///< each once
  std::vector<Eigen::Vector2d> sites;  ///< of the cells, in their order
};

/// Applies a change, after all earlier ones of the same outline; (u, v). If it throws, it can be applied
/// again.
std::vector<Polygon> polygons_with(const OutlineChange& change);

/// One change instead of several of a surface, newest first.
OutlineChange folded(const std::vector<const OutlineChange*>& newest_first);

}  // namespace octosurf::surfaces
