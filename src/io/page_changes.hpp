#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <octosurf/page.hpp>

// What a page that follows a map is told; web/src/follow.js reads it. A PageBlock, compressed, not as text.

namespace octosurf {

/// Surfaces and cylinders that appeared or changed since a revision, whole, and the ids of those that are gone. Empty
/// `since`: everything, in the place of whatever was known.
struct PageChanges {
  const PageMap& map;
  Eigen::Vector3d up;
  std::string run;  ///< whose revisions these are
  std::optional<std::uint64_t> since;
};

/// Throws Error(usage) for a revision to come.
std::string page_changes_message(const PageChanges& changes);

/// All voxels, with `slices` the slices of free space, too: merged until they take no more than `most_bytes`, as a
/// page's are.
std::string page_voxels_message(const PageMap& map, const Eigen::Vector3d& up, bool slices,
                                std::size_t most_bytes);

}  // namespace octosurf
