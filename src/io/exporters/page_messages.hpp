#pragma once

#include "io/exporters/page_block.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <octosurf/changes.hpp>
#include <octosurf/page.hpp>

// What a page knows of a map: a message with its surfaces, and one with its voxels. A page in a file has them
// inside; a page that follows a map gets them from the server. web/src/data.js reads them.

namespace octosurf::io {

/// A message of surfaces: how much of the map, and what goes with it.
struct SurfacesMessage {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  std::optional<MapChanges> changes{};  ///< only what changed: changes_since() a revision
  std::string run{};                    ///< identifies the run of these revisions
};

/// The surfaces and cylinders as export_surfaces() writes them, without `boundary`, and what is beside them
/// in the PageMap. Throws Error(data) for numbers that are not finite.
std::string surfaces_message(const PageMap& map, const SurfacesMessage& how);

/// The occupied voxels, merged as far as they must be not to exceed `most_bytes`; at last none.
struct VoxelsMessage {
  std::string packed;
  std::size_t voxels = 0;  ///< drawn
  int merged = 1;          ///< voxels' edges in the edge of a drawn one; 0: none is drawn
};

VoxelsMessage voxels_message(const PageMap& map, double most_bytes);

/// {"since", "revision", "appeared", "changed", "gone", "merged", "split"}
PageBlock::Json changes_json(const MapChanges& changes);

/// What appeared or changed since a revision.
Snapshot changed_part(const Snapshot& snapshot, std::uint64_t since);

}  // namespace octosurf::io
