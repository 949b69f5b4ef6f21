#pragma once

#include "planning/bit_raster.hpp"

#include <Eigen/Geometry>
#include <optional>
#include <span>

#include <octosurf/contact.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// Cells of part of a surface's plane that a contact on it, with its margins, must not touch.
struct ContactCells {
  BitRaster outside;    ///< the surface's outline, or on its edges
  BitRaster obstacles;  ///< covered by occupied voxels, all or partly between `obstacle_from_m` and
                        ///< `clearance_m` above the plane, that are not the surface's own
  BitRaster unknown;    ///< by unknown ones between `obstacle_from_m` and `unknown_to_m` in which something
                        ///< could hide (unknown_space.hpp)

  /// None marked, on the cells of a box.
  ContactCells(const Eigen::AlignedBox2d& box, double edge)
      : outside(box, edge), obstacles(outside), unknown(outside) {}
  /// By those limits that are above 0; octree and others as contact_region()'s. `near`: where obstacles and
  /// unknown space are marked.
  ContactCells(const Surface& surface, const Eigen::AlignedBox2d& box, const Eigen::AlignedBox2d& near,
               double edge, const ContactLimits& limits, const OccupancyView* octree, const Snapshot* others);
};

/// contact_region() on these cells.
ContactRegion region_on(const ContactCells& cells, const Surface& surface, const ContactShape& shape,
                        std::optional<double> yaw_rad, const ContactLimits& limits);

/// foothold() on these cells, which together hold the contact's surroundings; none: far off the surface.
Foothold foothold_on(std::span<const ContactCells* const> cells, const Surface& surface,
                     const ContactShape& shape, const Eigen::Vector3d& at, double yaw_rad,
                     const ContactLimits& limits);

}  // namespace octosurf::planning
