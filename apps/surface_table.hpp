#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>

#include <octosurf/surface.hpp>

namespace octosurf {

/// The surfaces of largest area, at most `count`, ties by id: a list of objects. `up`: for their slopes.
nlohmann::ordered_json largest_surfaces(const Snapshot& snapshot, std::size_t count,
                                        const Eigen::Vector3d& up);

double total_area(const Snapshot& snapshot);  ///< m²

}  // namespace octosurf
