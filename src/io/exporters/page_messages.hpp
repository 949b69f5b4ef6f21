#pragma once

#include "io/exporters/page_block.hpp"

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/changes.hpp>
#include <octosurf/page.hpp>

// What a page knows of a map: a message with its surfaces, and one with its voxels. A page in a file has them
// inside; a page that follows a map gets them from the server. web/src/data.js reads them.

namespace octosurf::io {

/// A message of surfaces: how much of the map, and what goes with it.
struct SurfacesMessage {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  std::optional<Eigen::Vector3d> suggested_up{};
  /// Only what changed since this revision.
  std::optional<std::uint64_t> since{};
  std::string run{};  ///< identifies the run of these revisions
  bool feet = true;  ///< with contact regions
};

/// The surfaces and cylinders as export_surfaces() writes them, without `boundary`, and what is beside them
/// in the PageMap. Throws Error(data) for numbers that are not finite and regions of other surfaces.
std::string surfaces_message(const PageMap& map, const SurfacesMessage& how);

/// An occupied voxel, or several merged to a larger one.
struct PageVoxel {
  int x = 0, y = 0, z = 0;  ///< its corner over its edge
  float log_odds = 0;
  SurfaceId surface = 0;
};

/// All occupied voxels, by z, then y, then x.
std::vector<PageVoxel> occupied_voxels(const OccupancyView& octree);

/// How many voxels' edges a drawn one has, as far as they must be merged. At last none is drawn: 0.
inline constexpr std::array<int, 7> voxel_merges{1, 2, 4, 8, 16, 32, 0};

struct VoxelsMessage {
  std::string packed;
  std::size_t voxels = 0;  ///< drawn
};

/// All `voxels` of the map, merged.
VoxelsMessage voxels_message(const PageMap& map, const std::vector<PageVoxel>& voxels, int merged);

/// {"since", "revision", "appeared", "changed", "gone", "merged", "split"}
PageBlock::Json changes_json(const MapChanges& changes);

/// What appeared or changed since a revision.
Snapshot changed_part(const Snapshot& snapshot, std::uint64_t since);

/// {"surface", "revision", "yaw_deg", "area_m2", "refused", "polygons"}
PageBlock::Json region_json(const Surface& surface, const ContactRegion& region);

}  // namespace octosurf::io
