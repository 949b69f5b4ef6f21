#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::bench {

/// A row of a table: regions of a sole of 0.22 × 0.11 m on one surface, and their pieces, over eight
/// headings: boundary points, ms (median and worst), parts, share of the region in 12 pieces (worst), pieces,
/// ms.
std::vector<std::string> time_regions(const std::string& name, const Surface& surface);

/// A hall of as many boundary points as are asked for: walls and the feet of racks, in steps of 3 cm, 1 cm
/// rough.
Surface hall(std::size_t points);

}  // namespace octosurf::bench
