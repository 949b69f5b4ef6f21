#include "io/exporters/scale_bar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

namespace octosurf::io {
namespace {

constexpr int glyph_width = 5, glyph_height = 7;
constexpr std::string_view glyphs = "0123456789cm. ";
/// Five pixels a row, the leftmost is the highest bit.
constexpr std::array<std::array<std::uint8_t, glyph_height>, glyphs.size()> font{{
    {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e},  // 0
    {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e},  // 1
    {0x0e, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1f},  // 2
    {0x1f, 0x02, 0x04, 0x02, 0x01, 0x11, 0x0e},  // 3
    {0x02, 0x06, 0x0a, 0x12, 0x1f, 0x02, 0x02},  // 4
    {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e},  // 5
    {0x06, 0x08, 0x10, 0x1e, 0x11, 0x11, 0x0e},  // 6
    {0x1f, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08},  // 7
    {0x0e, 0x11, 0x11, 0x0e, 0x11, 0x11, 0x0e},  // 8
    {0x0e, 0x11, 0x11, 0x0f, 0x01, 0x02, 0x0c},  // 9
    {0x00, 0x00, 0x0e, 0x10, 0x10, 0x11, 0x0e},  // c
    {0x00, 0x00, 0x1a, 0x15, 0x15, 0x15, 0x15},  // m
    {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c},  // .
    {0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00},
}};

std::string text_of(double length_m) {
  std::array<char, 32> text{};
  if (length_m < 1)
    std::snprintf(text.data(), text.size(), "%g cm", 100 * length_m);
  else
    std::snprintf(text.data(), text.size(), "%.0f m", length_m);
  return text.data();
}

class Pixels {
 public:
  Pixels(std::vector<std::uint8_t>& rgb, int width, int height) : rgb_(rgb), width_(width), height_(height) {}

  void fill(int x, int y, int wide, int high, std::uint8_t grey) {
    for (int row = std::max(0, y); row < std::min(height_, y + high); ++row)
      for (int column = std::max(0, x); column < std::min(width_, x + wide); ++column) {
        const std::size_t at = 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                                    static_cast<std::size_t>(column));
        std::fill_n(rgb_.begin() + static_cast<std::ptrdiff_t>(at), 3, grey);
      }
  }

  void write(const std::string& text, int x, int y, int dot, std::uint8_t grey) {
    for (const char letter : text) {
      const std::size_t glyph = glyphs.find(letter);
      for (int row = 0; row < glyph_height && glyph != std::string_view::npos; ++row)
        for (int column = 0; column < glyph_width; ++column)
          if ((font[glyph][static_cast<std::size_t>(row)] >> (glyph_width - 1 - column)) & 1)
            fill(x + column * dot, y + row * dot, dot, dot, grey);
      x += (glyph_width + 1) * dot;
    }
  }

 private:
  std::vector<std::uint8_t>& rgb_;
  int width_, height_;
};

}  // namespace

BarLength bar_length(int width, double pixels_per_m) {
  const double most_m = 0.2 * width / pixels_per_m;
  const double power = std::pow(10, std::floor(std::log10(most_m)));
  double length_m = power;
  for (const int times : {2, 5})
    if (times * power <= most_m) length_m = times * power;
  return {length_m, static_cast<int>(std::lround(length_m * pixels_per_m))};
}

void draw_scale_bar(std::vector<std::uint8_t>& rgb, int width, int height, double pixels_per_m) {
  constexpr std::uint8_t paper = 245, ink = 30;
  const int dot = std::max(1, (std::min(width, height) + 160) / 320);  // of letters, pixels
  const BarLength bar = bar_length(width, pixels_per_m);
  const std::string text = text_of(bar.length_m);
  const int text_width = static_cast<int>(text.size()) * (glyph_width + 1) * dot, line = 3 * dot;
  const int text_height = glyph_height * dot, edge = 4 * dot;
  const int wide = std::max(bar.pixels, text_width) + 2 * edge, high = text_height + line + 3 * edge;
  if (!(bar.pixels >= 8) || 2 * wide > width || 4 * high > height) return;
  Pixels pixels(rgb, width, height);
  const int left = 2 * dot, top = height - high - 2 * dot;
  pixels.fill(left, top, wide, high, paper);
  pixels.write(text, left + edge, top + edge, dot, ink);
  pixels.fill(left + edge, top + 2 * edge + text_height, bar.pixels, line, ink);
}

}  // namespace octosurf::io
