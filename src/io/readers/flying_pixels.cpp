#include "io/readers/flying_pixels.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::io {
namespace {

/// m: a smaller offset stays within a voxel.
constexpr float least_offset = 0.01F;

/// 1/m, times depth²: four standard deviations of a depth camera (1.5 mm at 1 m; Khoshelham and Elberink
/// 2012).
constexpr float noise = 4 * 0.0015F;

/// Whether `at[0]` lies clearly between the readings `near` before and after. Without branches, so that
/// compilers compute several at once: hardly any does.
unsigned between(const float* at, std::ptrdiff_t near) {
  const float z = at[0], before = at[-near], after = at[near];
  const float offset = std::max(least_offset, noise * z * z);
  return static_cast<unsigned>(std::min(before, after) < z - offset) &
         static_cast<unsigned>(std::max(before, after) > z + offset);
}

/// Whether `at[0]` is on a ramp; its neighbours are `step` apart. at[±2 · ramp_width · step] must be there.
bool flies(const float* at, std::ptrdiff_t step) {
  const std::ptrdiff_t near = ramp_width * step;
  if (between(at, near) == 0) return false;
  const float z = at[0], before = at[-near], after = at[near];
  const float offset = std::max(least_offset, noise * z * z);
  const float beyond_before = at[-2 * near], beyond_after = at[2 * near];
  if (!(std::min({z, before, after, beyond_before, beyond_after}) > 0)) return false;
  // Inverse depths: on a plane they change by the same from place to place.
  const float change = 1 / after - 1 / before;
  const float change_before = 1 / before - 1 / beyond_before, change_after = 1 / beyond_after - 1 / after;
  if (std::max(std::fabs(change_before), std::fabs(change_after)) > std::fabs(change) / 4) return false;
  // Where the two surfaces would be seen here.
  const float first = 1 / (1 / before + change_before), second = 1 / (1 / after - change_after);
  return std::min(first, second) < z - offset && std::max(first, second) > z + offset;
}

/// Adds those of [begin, end) on a ramp.
void add_flying(const std::vector<float>& depth, std::size_t begin, std::size_t end, std::ptrdiff_t step,
                std::vector<std::size_t>& flying) {
  constexpr std::size_t together = 32;
  for (std::size_t first = begin; first < end; first += together) {
    const std::size_t last = std::min(first + together, end);
    unsigned any = 0;
    for (std::size_t i = first; i < last; ++i) any |= between(&depth[i], ramp_width * step);
    if (any == 0) continue;
    for (std::size_t i = first; i < last; ++i)
      if (flies(&depth[i], step)) flying.push_back(i);
  }
}

}  // namespace

void erase_flying_pixels(std::vector<float>& depth, std::size_t width) {
  constexpr auto margin = static_cast<std::size_t>(2 * ramp_width);
  const std::size_t height = width == 0 ? 0 : depth.size() / width;
  std::vector<std::size_t> flying;
  if (width > 2 * margin)
    for (std::size_t v = 0; v < height; ++v)
      add_flying(depth, v * width + margin, (v + 1) * width - margin, 1, flying);
  if (height > 2 * margin)
    add_flying(depth, margin * width, (height - margin) * width, static_cast<std::ptrdiff_t>(width), flying);
  for (const std::size_t i : flying) depth[i] = 0;
}

}  // namespace octosurf::io
