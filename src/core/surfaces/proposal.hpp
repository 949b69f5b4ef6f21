#pragma once

#include "occupancy/point_window.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {

/// Assigns a pending point to a surface.
struct Assignment {
  PointId point{};
  SurfaceId surface = 0;
};

/// Planes that a stage found in a part of the map, for Ledger::apply(): which of the map's surfaces continue
/// in them follows from their points.
struct Proposal {
  /// Number of a plane: its place in `planes`. The first one is no plane: its points are pending.
  using Label = std::uint32_t;
  struct FoundPlane {
    Plane plane;
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  };
  struct Labelled {
    PointId point;
    Label label;
  };
  /// The inliers of a surface that are not among the points.
  struct Rest {
    SurfaceId surface;
    Label label;
    double readings;  ///< their number
  };

  std::vector<FoundPlane> planes = std::vector<FoundPlane>(1);
  std::vector<Labelled> points;
  std::vector<Rest> rest;
  std::vector<PointId> unprocessed;  ///< pending points that the next scan looks at again
  std::vector<std::vector<PointId>>
      curved;  ///< points of patches in which cylinders begin: curved, or too narrow
};

}  // namespace octosurf::surfaces
