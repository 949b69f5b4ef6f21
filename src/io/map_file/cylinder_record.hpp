#pragma once

#include "surfaces/map_state.hpp"

#include <string>

namespace octosurf {

namespace map_file {
class Cylinder;
}

void write_cylinder(const CylinderModel& cylinder, map_file::Cylinder& record);

/// Inverse; the voxels' points are taken from `state`, whose surfaces and earlier cylinders are complete.
/// Throws Error(data) unless every number is there, finite and possible, and every voxel holds a pending
/// point near the mantle that supports no other cylinder.
CylinderModel read_cylinder(const map_file::Cylinder& record, const MapState& state,
                            const std::string& where);

}  // namespace octosurf
