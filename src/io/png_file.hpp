#pragma once

#include <cstdint>
#include <ostream>
#include <vector>

namespace octosurf::io {

/// Writes an 8-bit RGB image, rows from the top. Throws Error(output) if it cannot be encoded.
void write_png(const std::vector<std::uint8_t>& rgb, int width, int height, std::ostream& out);

}  // namespace octosurf::io
