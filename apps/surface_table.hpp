#pragma once

#include <cstddef>
#include <vector>

#include <octosurf/stairs.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// The surfaces of largest area, at most `count`; ties by id.
std::vector<SurfacePtr> largest_surfaces(const Snapshot& snapshot, std::size_t count);

/// Prints them on stdout, a row each below a header. `up`: for their slopes.
void print_table(const std::vector<SurfacePtr>& surfaces, const Eigen::Vector3d& up);
void print_table(const std::vector<CylinderPtr>& cylinders);
void print_table(const std::vector<Stair>& stairs);

double total_area(const Snapshot& snapshot);  ///< m²

}  // namespace octosurf
