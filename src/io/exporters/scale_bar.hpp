#pragma once

#include <cstdint>
#include <vector>

namespace octosurf::io {

/// Length of a picture's scale bar.
struct BarLength {
  double length_m = 0;  ///< 1, 2 or 5 times a power of ten
  int pixels = 0;
};

/// The longest one within a fifth of the picture's width.
BarLength bar_length(int width, double pixels_per_m);

/// Draws a bar of that length, with its number, into the lower left corner of a picture of 3 bytes a pixel.
/// Does nothing if the picture is too small.
void draw_scale_bar(std::vector<std::uint8_t>& rgb, int width, int height, double pixels_per_m);

}  // namespace octosurf::io
