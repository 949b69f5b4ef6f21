#pragma once

#include "alignment/alignment_state.hpp"
#include "surfaces/map_state.hpp"

#include <optional>
#include <string>
#include <vector>

namespace octosurf::map_file {
class Alignment;
class Cylinder;
class SeenPatches;
class Surface;
}  // namespace octosurf::map_file

namespace octosurf::io {

// Records of a map file. Reading throws Error(data) about `where` unless every number is present, finite,
// possible and consistent with the others and with `state`.

/// Without its inliers, which the reader takes from the octree: the points with the record's id.
void write_surface(surfaces::SurfaceModel::State& surface, map_file::Surface& record);
surfaces::SurfaceModel::State read_surface(map_file::Surface& record, std::vector<surfaces::Inlier> inliers,
                                           const surfaces::MapState& state, const std::string& where);

/// Every voxel of a cylinder that is read holds a pending point near the lateral surface that supports no
/// other cylinder; surfaces and earlier cylinders are complete by then.
void write_cylinder(surfaces::CylinderModel cylinder, map_file::Cylinder& record);
surfaces::CylinderModel read_cylinder(map_file::Cylinder& record, const surfaces::MapState& state,
                                      const std::string& where);

void write_alignment(alignment::AlignmentState state, map_file::Alignment& record);
alignment::AlignmentState read_alignment(map_file::Alignment& record, const std::string& where);

/// Reading adds to `patches`, whose keys are all below the record's.
void write_patch(alignment::SeenPatches::Change patch, map_file::SeenPatches& record);
void read_patches(map_file::SeenPatches& record, const std::string& where, alignment::SeenPatches& patches,
                  std::optional<alignment::SeenPatches::Key>& last);

}  // namespace octosurf::io
