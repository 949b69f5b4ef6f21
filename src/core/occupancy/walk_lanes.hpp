#pragma once

#include "occupancy/grid_ray.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#if defined(__x86_64__) && defined(__GNUC__)
#define OCTOSURF_HAS_LANES 1
#endif

namespace octosurf::occupancy {

/// Where a walk sets its bits. `mask`: each axis' address bits (BlockAddress); `pages` may be null.
struct BitTarget {
  std::uint64_t* bits;
  std::uint8_t* pages;
  std::array<std::uint64_t, 3> mask;
};

#ifdef OCTOSURF_HAS_LANES

/// Rays side by side in vector registers.
struct RayLanes {
  static constexpr std::size_t width = 4;
  alignas(32) double t[3][width]{}, dt[3][width]{};
  alignas(32) std::uint64_t step[3][width]{};  // address increment along each axis
  alignas(32) std::uint64_t address[width]{};
  std::int64_t left[width]{};  // remaining steps
};

/// Steps the lanes until the first arrives: sets the bits of the current voxels, then moves each lane along
/// the axis that GridWalk::next_axis would choose. Eight by AVX-512 take a fifth less time each.
template <bool paged>
[[gnu::target("avx2")]] void advance(const BitTarget& to, RayLanes& lanes) {
  typedef double Reals __attribute__((vector_size(32)));
  typedef std::int64_t Masks __attribute__((vector_size(32)));
  typedef std::uint64_t Words __attribute__((vector_size(32)));
  auto* t = reinterpret_cast<Reals*>(lanes.t);
  const auto* dt = reinterpret_cast<Reals*>(lanes.dt);
  const auto* e = reinterpret_cast<Words*>(lanes.step);
  Reals tx = t[0], ty = t[1], tz = t[2];
  const Reals dx = dt[0], dy = dt[1], dz = dt[2];
  const Words ex = e[0], ey = e[1], ez = e[2];
  const Words mx = Words{} + to.mask[0], my = Words{} + to.mask[1], mz = Words{} + to.mask[2];
  Words address = *reinterpret_cast<Words*>(lanes.address);
  const std::int64_t n = *std::min_element(lanes.left, lanes.left + RayLanes::width);
  for (std::int64_t i = 0; i < n; ++i) {
    Words word = address >> 6, bit = (Words{} + 1) << (address & 63);
    // Forces a read from memory: GCC at -O3 would extract each lane from its register instead, which is five
    // times as slow on some processors.
    asm volatile("" : "+m"(word), "+m"(bit));
    for (std::size_t lane = 0; lane < RayLanes::width; ++lane) {
      to.bits[word[lane]] |= bit[lane];
      if constexpr (paged) to.pages[word[lane] >> 9] = 1;
    }
    const Masks xy = tx < ty, xz = tx < tz, yz = ty < tz;
    const Masks x = xy & xz, y = ~xy & yz, z = ~(x | y);
    tx = x ? tx + dx : tx;
    ty = y ? ty + dy : ty;
    tz = z ? tz + dz : tz;
    const Words m = x ? mx : y ? my : mz, step = x ? ex : y ? ey : ez;
    address = (((address | ~m) + step) & m) | (address & ~m);
  }
  t[0] = tx, t[1] = ty, t[2] = tz;
  *reinterpret_cast<Words*>(lanes.address) = address;
  for (std::int64_t& left : lanes.left) left -= n;
}

#endif

/// Walks rays that all start in one voxel and take GridWalk::steps steps each, setting a bit for every voxel
/// they leave. Four rays run in parallel lanes where the processor has AVX2, because a single ray stalls on
/// its own comparison at every step. Additions and comparisons equal those of the scalar walk, so the bits do
/// too.
class LaneWalker {
 public:
  LaneWalker(const BitTarget& to, std::uint64_t start) : to_(to), start_(start) {}

  /// next(GridWalk&) fetches the next ray; false: none is left. `side_by_side`: where the processor can.
  template <class Next>
  void run(Next&& next, bool side_by_side = true) {
#ifdef OCTOSURF_HAS_LANES
    if (side_by_side && __builtin_cpu_supports("avx2")) run_lanes(next);
#endif
    GridWalk walk;
    while (next(walk)) walk_alone(walk, start_, walk.steps);
  }

 private:
  void mark(std::uint64_t address) {
    to_.bits[address >> 6] |= std::uint64_t{1} << (address & 63);
    if (to_.pages != nullptr) to_.pages[address >> 15] = 1;
  }
  /// Increment for an address whose other axes' bits are ones; minus one is all ones.
  std::uint64_t step_of(std::size_t axis, int sign) const {
    return sign > 0 ? to_.mask[axis] & -to_.mask[axis] : to_.mask[axis];
  }
  void walk_alone(GridWalk walk, std::uint64_t address, std::int64_t steps) {
    for (; steps > 0; --steps) {
      mark(address);
      const std::size_t a = walk.next_axis();
      const std::uint64_t m = to_.mask[a];
      address = (((address | ~m) + step_of(a, walk.sign[a])) & m) | (address & ~m);
      walk.t[a] += walk.dt[a];
    }
  }

#ifdef OCTOSURF_HAS_LANES
  template <class Next>
  void run_lanes(Next& next) {
    constexpr std::size_t width = RayLanes::width;
    RayLanes lanes;
    std::array<GridWalk, width> walks;
    std::size_t filled = 0;
    for (GridWalk walk; filled < width && next(walk); ++filled) fill(lanes, filled, walks[filled] = walk);
    while (filled == width) {
      to_.pages != nullptr ? advance<true>(to_, lanes) : advance<false>(to_, lanes);
      for (std::size_t lane = 0; lane < width && filled == width; ++lane) {
        if (lanes.left[lane] > 0) continue;
        if (GridWalk walk; next(walk))
          fill(lanes, lane, walks[lane] = walk);
        else
          filled = 0;
      }
    }
    for (std::size_t lane = 0; lane < width; ++lane) {  // lanes still active when rays run out
      for (std::size_t a = 0; a < 3; ++a) walks[lane].t[a] = lanes.t[a][lane];
      walk_alone(walks[lane], lanes.address[lane], lanes.left[lane]);
    }
  }
  void fill(RayLanes& lanes, std::size_t lane, const GridWalk& walk) const {
    for (std::size_t a = 0; a < 3; ++a) {
      lanes.t[a][lane] = walk.t[a];
      lanes.dt[a][lane] = walk.dt[a];
      lanes.step[a][lane] = step_of(a, walk.sign[a]);
    }
    lanes.address[lane] = start_;
    lanes.left[lane] = walk.steps;
  }
#endif

  BitTarget to_;
  std::uint64_t start_;
};

}  // namespace octosurf::occupancy
