#pragma once

#include <cstdint>
#include <vector>

namespace octosurf::io {

/// A length as a picture's scale bar shows it.
struct BarLength {
  double length_m = 0;  ///< 1, 2 or 5 times a power of ten
  int pixels = 0;
};

/// The longest one that takes no more than a fifth of the picture's width.
BarLength bar_length(int width, double pixels_per_m);

/// Draws a bar of that length, with its number, into the lower left corner of a picture of 3 bytes a pixel.
/// Nothing where the picture is too small for it.
void draw_scale_bar(std::vector<std::uint8_t>& rgb, int width, int height, double pixels_per_m);

}  // namespace octosurf::io
