#include "planning/edge_reaches.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace octosurf::planning {
namespace {

// GCC's and Clang's vector extension: uses the target's vector registers, or plain code. Each lane rounds as
// a single double does.
using Four = double __attribute__((vector_size(32)));
using FourBits = std::int64_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void load(const double* from, Four& four) {
  std::memcpy(&four, from, sizeof four);
}

[[gnu::always_inline]] inline std::uint32_t near_of_eight(const double* rows, std::size_t sides,
                                                          const LineExtent& line) {
  constexpr std::size_t n = EdgeReaches::at_once;
  FourBits beyond[2] = {FourBits{}, FourBits{}};
  const double* lows = line.low();
  for (std::size_t k = 0; k < sides; ++k) {
    const double low = lows[k];
    for (std::size_t half = 0; half < 2; ++half) {
      Four reach;
      load(rows + n * k + 4 * half, reach);
      beyond[half] |= reach <= Four{low, low, low, low};
    }
  }
  const double *front = rows + n * sides, *back = front + n, *right_u = back + n, *right_v = right_u + n;
  for (std::size_t half = 0; half < 2; ++half) {
    Four u, v, to_front, to_back;
    load(right_u + 4 * half, u);
    load(right_v + 4 * half, v);
    load(front + 4 * half, to_front);
    load(back + 4 * half, to_back);
    const Four along_from = u * line.from.x() + v * line.from.y(),
               along_to = u * line.to.x() + v * line.to.y();
    beyond[half] |= ((to_front <= along_from) & (to_front <= along_to)) |
                    ((to_back >= along_from) & (to_back >= along_to));
  }
  const FourBits bits = (~beyond[0] & FourBits{1, 2, 4, 8}) | (~beyond[1] & FourBits{16, 32, 64, 128});
  return static_cast<std::uint32_t>((bits[0] | bits[1]) | (bits[2] | bits[3]));
}

using Near = std::uint32_t (*)(const double*, std::size_t, const LineExtent&);

std::uint32_t near_anywhere(const double* rows, std::size_t sides, const LineExtent& line) {
  return near_of_eight(rows, sides, line);
}
#if defined(__x86_64__)
[[gnu::target("avx2")]] std::uint32_t near_with_avx2(const double* rows, std::size_t sides,
                                                     const LineExtent& line) {
  return near_of_eight(rows, sides, line);
}
const Near best = __builtin_cpu_supports("avx2") ? near_with_avx2 : near_anywhere;
#else
const Near best = near_anywhere;
#endif

}  // namespace

void EdgeReaches::assign(const ConvexLines& kernel, std::size_t eights) {
  kernel_ = kernel;
  sides_ = kernel.corners.size();
  rows_.resize(eights * (sides_ + 4) * at_once);
  const std::size_t fours = (sides_ + 3) / 4;
  normals_.assign(8 * fours, 0);
  for (std::size_t k = 0; k < sides_; ++k) {
    normals_[k] = kernel.normals[k].x();
    normals_[4 * fours + k] = kernel.normals[k].y();
  }
}

// Arrays of eight, for vectorisation.
std::array<std::uint32_t, EdgeReaches::at_once> EdgeReaches::set(std::uint32_t eight,
                                                                 std::span<const Eigen::Vector2d> corners) {
  std::array<double, at_once + 1> u, v, along;
  for (std::size_t i = 0; i <= at_once; ++i) {
    const Eigen::Vector2d& corner = corners[std::min(i, corners.size() - 1)];
    u[i] = corner.x();
    v[i] = corner.y();
  }
  double* row = &rows_[eight * (sides_ + 4) * at_once];
  for (std::size_t k = 0; k < sides_; ++k, row += at_once) {
    const Eigen::Vector2d normal = kernel_.normals[k];
    for (std::size_t i = 0; i <= at_once; ++i) along[i] = normal.x() * u[i] + normal.y() * v[i];
    for (std::size_t i = 0; i < at_once; ++i) row[i] = std::max(along[i], along[i + 1]) + kernel_.offsets[k];
  }
  std::array<std::uint32_t, at_once> farthest{};
  double *front = row, *back = front + at_once, *right_u = back + at_once, *right_v = right_u + at_once;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Eigen::Vector2d step = corners[i + 1] - corners[i], right = right_of(step);
    const auto [to_right, to_left] = kernel_.farthest_beside(step);
    farthest[i] = static_cast<std::uint32_t>(to_right);
    front[i] = right.dot(corners[i] + kernel_.corners[to_right]);
    back[i] = right.dot(corners[i] + kernel_.corners[to_left]);
    right_u[i] = right.x();
    right_v[i] = right.y();
  }
  // Unused edges get an empty reach.
  for (std::size_t i = corners.size() - 1; i < at_once; ++i)
    for (double* of = &rows_[eight * (sides_ + 4) * at_once]; of <= right_v; of += at_once) of[i] = -HUGE_VAL;
  return farthest;
}

void EdgeReaches::measure(const Eigen::Vector2d& from, const Eigen::Vector2d& to, LineExtent& line) const {
  line.from = from;
  line.to = to;
  const std::size_t sides = normals_.size() / 2;  // rounded up to fours
  if (line.along.size() != 3 * sides) line.along.resize(3 * sides);
  double* along = line.along.data();
  for (std::size_t k = 0; k < sides; k += 4) {
    Four u, v;
    load(&normals_[k], u);
    load(&normals_[sides + k], v);
    const Four of_from = u * from.x() + v * from.y(), of_to = u * to.x() + v * to.y(),
               low = of_to < of_from ? of_to : of_from;
    std::memcpy(along + k, &of_from, sizeof of_from);
    std::memcpy(along + sides + k, &of_to, sizeof of_to);
    std::memcpy(along + 2 * sides + k, &low, sizeof low);
  }
}

std::uint32_t EdgeReaches::near(std::uint32_t eight, const LineExtent& line) const {
  return best(&rows_[eight * (sides_ + 4) * at_once], sides_, line);
}

bool EdgeReaches::cut(std::uint32_t edge, const LineExtent& line, Cut& cut) const {
  const double* row = &rows_[edge / at_once * (sides_ + 4) * at_once + edge % at_once];
  const double *front = row + sides_ * at_once, *back = front + at_once;
  const Eigen::Vector2d right(back[at_once], back[2 * at_once]);
  const double along_from = right.dot(line.from), along_to = right.dot(line.to);
  const auto m = static_cast<std::uint32_t>(sides_);
  if (!cut.by(*front - along_from, *front - along_to, m) ||
      !cut.by(along_from - *back, along_to - *back, m + 1))
    return false;
  const double *of_from = line.from_along(), *of_to = line.to_along();
  for (std::uint32_t k = 0; k < m; ++k, row += at_once)
    if (!cut.by(*row - of_from[k], *row - of_to[k], k)) return false;
  return true;
}

}  // namespace octosurf::planning
