#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

/// Throws Error(data) for a scan whose insertion takes more memory than `available`, bytes (0: not known),
/// and names a resolution at which it takes half of that. In some 50 ms, less where that is out of the
/// question.
void require_memory(const Scan& scan, const OccupancyParameters& parameters, std::uint64_t available);

/// The first scans of a run.
struct FirstScans {
  std::size_t count = 0, left = 0;    ///< scans inserted, and to be inserted
  double scan_s = 0, interval_s = 0;  ///< mean time of an insertion, and between stamps
  double bytes_first = 0, bytes = 0;  ///< of the octree, after the first and after the last of them
};
/// What the rest will cost in memory and time, if it is more than `available`, or slower than scans came and
/// than one a second; with a resolution that would hold. Empty: it is not.
std::string cost_warning(const FirstScans& first, const Scan& scan, const OccupancyParameters& parameters,
                         std::uint64_t available);

/// Says that a scan's readings lie so far apart that no surface bridges them; empty: they do not.
std::string spacing_warning(const Scan& scan, const Parameters& parameters);

/// Bytes that the machine has left for programs; 0: not known.
std::uint64_t available_memory();

}  // namespace octosurf
