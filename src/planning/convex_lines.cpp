#include "planning/convex_lines.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace octosurf::planning {
namespace {

constexpr double jitter = 5e-7;  // m

}  // namespace

ConvexLines::ConvexLines(const Ring2& ring) : corners(ring) {
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Eigen::Vector2d along = ring[k + 1 < ring.size() ? k + 1 : 0] - ring[k];
    box.extend(ring[k]);
    normals.push_back(right_of(along));
    offsets.push_back(normals.back().dot(ring[k]));
    turns_.push_back(turn_of(along));
  }
  const auto least = std::min_element(turns_.begin(), turns_.end());
  first_ = static_cast<std::size_t>(least - turns_.begin());
  std::rotate(turns_.begin(), least, turns_.end());
}

Eigen::Vector2d jitter_of(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
  std::uint64_t state = 0;
  const auto stir = [&state](double value) {  // splitmix64
    state = (state ^ std::bit_cast<std::uint64_t>(value)) + 0x9e3779b97f4a7c15u;
    state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9u;
    state = (state ^ (state >> 27)) * 0x94d049bb133111ebu;
    state ^= state >> 31;
  };
  for (const double value : {p.x(), p.y(), q.x(), q.y()}) stir(value);
  const auto part = [](std::uint64_t bits) {
    return static_cast<double>(bits & 0xffffffffu) / 0x7fffffff - 1;
  };
  return jitter * Eigen::Vector2d(part(state), part(state >> 32));
}

}  // namespace octosurf::planning
