#pragma once

#include <cstdint>

#include <octosurf/scan.hpp>

namespace octosurf::sensing {

/// Of a scan's readings and the pose that it was given with, whatever its name and time stamp, which another
/// order of inputs changes: CRC-64/XZ of the pose, the number of points, and every k-th of them, 4096 at
/// most. Saved with maps, so it stays as it is.
std::uint64_t fingerprint_of(const Scan& scan);

}  // namespace octosurf::sensing
