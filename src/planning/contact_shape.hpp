#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <octosurf/contact.hpp>

namespace octosurf::planning {

/// Corners of the regular polygons drawn around discs: 1 / cos(π / 32) is 1.0048, the 0.5 % of contact.hpp.
inline constexpr int disc_corners = 32;

/// Convex polygon around a disc about the origin, counter-clockwise; the origin alone if `radius` is 0.
Ring2 around_disc(double radius);

/// The convex hull, counter-clockwise, without points on its edges.
Ring2 convex_hull(Ring2 points);

/// {p + q}, of two convex polygons (or points, or segments).
Ring2 minkowski_sum(const Ring2& a, const Ring2& b);

Ring2 mirrored(Ring2 ring);  ///< through the origin

/// A contact at a heading, in a plane rotated with it: x along the heading. Contact planning uses this frame,
/// about the contact's middle.
struct Sole {
  Ring2 outline;  ///< convex, counter-clockwise, about its own middle; a disc as the polygon around it
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();    ///< from the reference point
  Eigen::Vector2d heading = Eigen::Vector2d::UnitX();  ///< unit, in the surface's frame

  /// From the rotated plane to the surface's frame; directions, or points about the same origin.
  Eigen::Vector2d to_surface(const Eigen::Vector2d& turned) const {
    return turned.x() * heading + turned.y() * Eigen::Vector2d(-heading.y(), heading.x());
  }
};

/// `shape` at a heading; for all headings (empty) the disc of its reach.
Sole sole_of(const ContactShape& shape, const Surface& surface, std::optional<double> yaw_rad,
             const Eigen::Vector3d& up);

/// Throws Error(usage) for an invalid shape, heading or limits, or missing inputs.
void require_sensible(const ContactShape& shape, std::optional<double> yaw_rad, const ContactLimits& limits,
                      const OccupancyView* octree);

/// The limits that reject the whole surface, for any position: slope, size, roughness, uncertainty, in this
/// order.
std::vector<ContactRefusal> refusals_of(const Surface& surface, const ContactLimits& limits);

}  // namespace octosurf::planning
