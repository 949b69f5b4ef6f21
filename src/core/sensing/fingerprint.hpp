#pragma once

#include <cstdint>

#include <octosurf/scan.hpp>

namespace octosurf::sensing {

/// Hash of a scan's readings and given pose, independent of its name and time stamp, which depend on the
/// order of inputs: CRC-64/XZ of the pose, the number of points, and every k-th of them, 4096 at most. Saved
/// with maps, so it must not change.
std::uint64_t fingerprint_of(const Scan& scan);

}  // namespace octosurf::sensing
