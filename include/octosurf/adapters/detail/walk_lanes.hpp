#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include <octosurf/adapters/detail/grid_ray.hpp>

#if defined(__x86_64__) && defined(__GNUC__)
#define OCTOSURF_HAS_LANES 1
#endif

namespace octosurf::detail {

/// Walks rays that all start in one voxel and take GridWalk::steps steps each, setting a bit for
/// every voxel they leave. Four rays go side by side in vector registers where the processor has
/// AVX2: one ray alone waits for its own comparison at every step. The lanes take rays far apart in
/// the scan, because rays that set bits in the same word wait for each other. Additions and comparisons are
/// those of the scalar walk, so the bits are the same.
class LaneWalker {
 public:
  /// `mask`: each axis' bits of an address (BlockAddress); `pages` may be null.
  LaneWalker(std::uint64_t* bits, std::uint8_t* pages, const std::array<std::uint64_t, 3>& mask,
             std::uint64_t start)
      : bits_(bits), pages_(pages), mask_(mask), start_(start) {}

  /// next(GridWalk&) gives the next ray; false: none is left.
  template <class Next>
  void run(Next&& next) {
    GridWalk walk;
#ifdef OCTOSURF_HAS_LANES
    if (__builtin_cpu_supports("avx2")) {
      Lanes lanes;
      std::size_t filled = 0;
      while (filled < 4 && next(walk)) fill(lanes, filled++, walk);
      while (filled == 4) {
        pages_ != nullptr ? advance<true>(lanes) : advance<false>(lanes);
        for (std::size_t lane = 0; lane < 4 && filled == 4; ++lane) {
          if (lanes.left[lane] > 0) continue;
          if (next(walk))
            fill(lanes, lane, walk);
          else
            filled = 0;
        }
      }
      for (std::size_t lane = 0; lane < 4; ++lane) finish(lanes, lane);
    }
#endif
    while (next(walk)) walk_alone(walk, start_, walk.steps);
  }

 private:
  void mark(std::uint64_t address) {
    bits_[address >> 6] |= std::uint64_t{1} << (address & 63);
    if (pages_ != nullptr) pages_[address >> 15] = 1;
  }
  std::uint64_t stepped(std::uint64_t address, std::size_t axis, int sign) const {
    const std::uint64_t m = mask_[axis];
    return (((address | ~m) + step_of(axis, sign)) & m) | (address & ~m);
  }
  std::uint64_t step_of(std::size_t axis, int sign) const {
    return sign > 0 ? mask_[axis] & -mask_[axis] : mask_[axis];  // minus one is all ones
  }
  void walk_alone(GridWalk walk, std::uint64_t address, std::int64_t steps) {
    for (; steps > 0; --steps) {
      mark(address);
      const std::size_t a = walk.next_axis();
      address = stepped(address, a, walk.sign[a]);
      walk.t[a] += walk.dt[a];
    }
  }

#ifdef OCTOSURF_HAS_LANES
  struct alignas(32) Lanes {
    double t[3][4]{}, dt[3][4]{};
    std::uint64_t step[3][4]{};
    std::uint64_t address[4]{};
    std::int64_t left[4]{};
    int sign[4][3]{};
  };
  void fill(Lanes& lanes, std::size_t lane, const GridWalk& walk) const {
    for (std::size_t a = 0; a < 3; ++a) {
      lanes.t[a][lane] = walk.t[a];
      lanes.dt[a][lane] = walk.dt[a];
      lanes.step[a][lane] = step_of(a, walk.sign[a]);
      lanes.sign[lane][a] = walk.sign[a];
    }
    lanes.address[lane] = start_;
    lanes.left[lane] = walk.steps;
  }
  void finish(const Lanes& lanes, std::size_t lane) {
    GridWalk walk;
    for (std::size_t a = 0; a < 3; ++a) {
      walk.t[a] = lanes.t[a][lane];
      walk.dt[a] = lanes.dt[a][lane];
      walk.sign[a] = lanes.sign[lane][a];
    }
    walk_alone(walk, lanes.address[lane], lanes.left[lane]);
  }

  /// Steps all four lanes until the first of them has arrived.
  template <bool paged>
  __attribute__((target("avx2"))) void advance(Lanes& lanes) {
    using Real = double __attribute__((vector_size(32)));
    using Bits = std::uint64_t __attribute__((vector_size(32)));
    const auto masked = [](Real v, auto m) __attribute__((always_inline, target("avx2"))) {
      return reinterpret_cast<Real>(reinterpret_cast<Bits>(v) & reinterpret_cast<Bits>(m));
    };
    Real tx = load<Real>(lanes.t[0]), ty = load<Real>(lanes.t[1]), tz = load<Real>(lanes.t[2]);
    const Real dx = load<Real>(lanes.dt[0]), dy = load<Real>(lanes.dt[1]), dz = load<Real>(lanes.dt[2]);
    const Bits ex = load<Bits>(lanes.step[0]), ey = load<Bits>(lanes.step[1]), ez = load<Bits>(lanes.step[2]);
    Bits address = load<Bits>(lanes.address);
    const Bits mx = Bits{} + mask_[0], my = Bits{} + mask_[1], mz = Bits{} + mask_[2], one = Bits{} + 1;
    const std::int64_t n = std::min({lanes.left[0], lanes.left[1], lanes.left[2], lanes.left[3]});
    for (std::int64_t i = 0; i < n; ++i) {
      alignas(32) std::uint64_t word[4], bit[4];
      store(word, address >> 6);
      store(bit, one << (address & 63));
      for (std::size_t lane = 0; lane < 4; ++lane) bits_[word[lane]] |= bit[lane];
      if constexpr (paged)
        for (std::size_t lane = 0; lane < 4; ++lane) pages_[word[lane] >> 9] = 1;

      const Bits xy = reinterpret_cast<Bits>(tx < ty), xz = reinterpret_cast<Bits>(tx < tz),
                 yz = reinterpret_cast<Bits>(ty < tz);
      const Bits is_x = xy & xz, is_y = ~xy & yz, is_z = ~(is_x | is_y);
      tx += masked(dx, is_x);
      ty += masked(dy, is_y);
      tz += masked(dz, is_z);
      const Bits m = (mx & is_x) | (my & is_y) | (mz & is_z);
      const Bits step = (ex & is_x) | (ey & is_y) | (ez & is_z);
      address = ((((address | ~m) + step) ^ address) & m) ^ address;
    }
    store(lanes.t[0], tx), store(lanes.t[1], ty), store(lanes.t[2], tz);
    store(lanes.address, address);
    for (std::int64_t& left : lanes.left) left -= n;
  }
  template <class V, class T>
  __attribute__((target("avx2"), always_inline)) static V load(const T* from) {
    return *reinterpret_cast<const V*>(from);
  }
  template <class V, class T>
  __attribute__((target("avx2"), always_inline)) static void store(T* to, V v) {
    *reinterpret_cast<V*>(to) = v;
  }
#endif

  std::uint64_t* bits_;
  std::uint8_t* pages_;
  std::array<std::uint64_t, 3> mask_;
  std::uint64_t start_;
};

}  // namespace octosurf::detail
