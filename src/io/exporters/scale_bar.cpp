#include "io/exporters/scale_bar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string_view>

namespace octosurf::io {
namespace {

constexpr int glyph_width = 5, glyph_height = 7;
/// All that such lengths need; five pixels a row, the leftmost is the highest bit.
constexpr std::string_view glyphs = "0125m.";
constexpr std::array<std::array<std::uint8_t, glyph_height>, glyphs.size()> font{{
    {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e},
    {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e},
    {0x0e, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1f},
    {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e},
    {0x00, 0x00, 0x1a, 0x15, 0x15, 0x15, 0x15},
    {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c},
}};

}  // namespace

void draw_scale_bar(std::vector<std::uint8_t>& rgb, int width, int height, double pixels_per_m) {
  constexpr std::uint8_t paper = 245, ink = 30;
  const double most_m = 0.2 * width / pixels_per_m, power = std::pow(10, std::floor(std::log10(most_m)));
  double length_m = power;
  for (const int times : {2, 5})
    if (times * power <= most_m) length_m = times * power;
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.*f m",
                std::max(0, static_cast<int>(std::lround(-std::log10(power)))), length_m);
  const std::string_view text = buffer.data();

  const int dot = std::max(1, (std::min(width, height) + 160) / 320);  // of letters, pixels
  const int bar = static_cast<int>(std::lround(length_m * pixels_per_m)), edge = 4 * dot, line = 3 * dot;
  const int wide = std::max(bar, static_cast<int>(text.size()) * (glyph_width + 1) * dot) + 2 * edge;
  const int high = glyph_height * dot + line + 3 * edge, left = 2 * dot, top = height - high - 2 * dot;
  if (!(bar >= 8) || 2 * wide > width || 4 * high > height) return;
  const auto fill = [&](int x, int y, int columns, int rows, std::uint8_t grey) {  // within the frame
    for (int row = top + y; row < top + y + rows; ++row)
      std::fill_n(rgb.begin() + 3 * (std::ptrdiff_t{row} * width + left + x), 3 * columns, grey);
  };
  fill(0, 0, wide, high, paper);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t glyph = glyphs.find(text[i]);
    for (int k = 0; k < glyph_height * glyph_width && glyph < font.size(); ++k)
      if ((font[glyph][static_cast<std::size_t>(k / glyph_width)] >> (glyph_width - 1 - k % glyph_width)) & 1)
        fill(edge + (static_cast<int>(i) * (glyph_width + 1) + k % glyph_width) * dot,
             edge + k / glyph_width * dot, dot, dot, ink);
  }
  fill(edge, 2 * edge + glyph_height * dot, bar, line, ink);
}

}  // namespace octosurf::io
