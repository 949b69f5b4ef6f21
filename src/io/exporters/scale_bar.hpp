#pragma once

#include <cstdint>
#include <vector>

namespace octosurf::io {

/// Draws a bar of 1, 2 or 5 times a power of ten metres, the longest within a fifth of the width, with its
/// length into the lower left corner of a picture of 3 bytes a pixel. Does nothing if the picture is too
/// small.
void draw_scale_bar(std::vector<std::uint8_t>& rgb, int width, int height, double pixels_per_m);

}  // namespace octosurf::io
