#pragma once

#include <numbers>
#include <optional>

#include <octosurf/surface.hpp>

namespace octosurf {

/// The place on a surface nearest to a point.
struct Nearest {
  SurfaceId id = 0;                                 ///< of the surface
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< map frame, on the surface's `polygons`
  double distance = 0;                              ///< m
};

/// Restricts a query to surfaces whose slope_rad() to `up` is at most `max_slope_rad`.
struct SlopeLimit {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame, any length; see up_of(map)
  double max_slope_rad = std::numbers::pi;        ///< π/2 excludes overhanging surfaces such as ceilings
};

/// The nearest place on a surface within the limit; empty if no such surface has a polygon; the lower id wins
/// a tie. `point` in the map frame; throws Error(usage) if it is not finite, or the limit is invalid. Cost
/// O(vertices) of the surfaces whose planes are nearer.
std::optional<Nearest> nearest(const Snapshot& snapshot, const Eigen::Vector3d& point,
                               const SlopeLimit& limit = {});

/// The first surface straight below a point (against `limit.up`) or at it: the one that a lowered foot
/// touches. Empty if there is none; the lower id wins a tie. Surfaces parallel to `up` are never met. Throws
/// as nearest() does. Cost O(vertices) of the surfaces below.
std::optional<Nearest> below(const Snapshot& snapshot, const Eigen::Vector3d& point,
                             const SlopeLimit& limit = {});

}  // namespace octosurf
