#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>

#include <octosurf/page.hpp>

// What a page that follows a map is told; web/src/follow.js reads it. A PageBlock, compressed, not as text.

namespace octosurf::io {

/// Surfaces and cylinders that appeared or changed, whole, and the ids of those that are gone: by
/// `map.changes`, if it is changes_since() a revision, else everything, in the place of whatever was known.
/// `run`: whose revisions these are.
std::string page_changes_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run);

/// All voxels, with `slices` the slices of free space, too: merged until they take no more than `most_bytes`,
/// as a page's are.
std::string page_voxels_message(const PageMap& map, const Eigen::Vector3d& up, bool slices,
                                std::size_t most_bytes);

}  // namespace octosurf::io
