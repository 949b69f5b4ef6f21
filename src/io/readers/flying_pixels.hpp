#pragma once

#include <cstddef>
#include <vector>

namespace octosurf::io {

/// Pixels from a reading on a ramp to the surfaces beside it: an edge blurs over two pixels on each side.
inline constexpr std::ptrdiff_t ramp_width = 4;

/// Sets readings between two surfaces, on neither, to 0. A pixel at an object's edge may see both sides, and
/// filters of cameras mix neighbours, so that a ramp a few pixels wide hangs between front and back.
///
/// Along its row or its column, such a reading is behind the surface on one side and before that on the
/// other, both continued to here, by more than the readings' noise. The two surfaces are those four to eight
/// pixels away; their depth changes less than across the edge, as a plane's does not, however slanted (its
/// inverse depth is linear in the image). Things of less than four pixels between a nearer and a farther one
/// are lost, too.
///
/// `depth`: m along the optical axis, row by row; 0: no reading. About 1 ns a pixel.
void erase_flying_pixels(std::vector<float>& depth, std::size_t width);

}  // namespace octosurf::io
