#pragma once

#include "surfaces/map_state.hpp"

#include <string>

namespace octosurf::map_file {
class Cylinder;
}  // namespace octosurf::map_file

namespace octosurf::io {

void write_cylinder(const surfaces::CylinderModel& cylinder, map_file::Cylinder& record);

/// Inverse; the voxels' points are taken from `state`, whose surfaces and earlier cylinders are complete.
/// Throws Error(data) unless every number is present, finite and valid, and every voxel has a pending point
/// near the mantle that supports no other cylinder.
surfaces::CylinderModel read_cylinder(const map_file::Cylinder& record, const surfaces::MapState& state,
                                      const std::string& where);

}  // namespace octosurf::io
