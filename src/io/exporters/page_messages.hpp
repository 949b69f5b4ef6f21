#pragma once

#include "io/exporters/page_block.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>

#include <octosurf/changes.hpp>
#include <octosurf/page.hpp>

// What a page knows of a map: a message with its surfaces, and one with its voxels. A page in a file has them
// inside; a page that follows a map gets them from the server. web/src/data.js reads them.

namespace octosurf::io {

/// The surfaces and cylinders as export_surfaces() writes them, without `boundary`, and what is beside them
/// in the PageMap: all, or only what changed since a revision, with these changes.
/// `run` identifies the run of these revisions. Throws Error(data) for numbers that are not finite.
PageBlock surfaces_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run = {},
                           const std::optional<MapChanges>& since = {});

/// The occupied voxels, merged as far as they must be not to exceed `most_bytes`; at last none.
std::string voxels_message(const PageMap& map, double most_bytes);

}  // namespace octosurf::io
