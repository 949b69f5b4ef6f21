#pragma once

#include "occupancy/grid_ray.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#if defined(__x86_64__) && defined(__GNUC__)
#define OCTOSURF_HAS_LANES 1
#include <immintrin.h>
#endif

namespace octosurf::occupancy {

/// Where a walk sets its bits. `mask`: each axis' address bits (BlockAddress); `pages` may be null.
struct BitTarget {
  std::uint64_t* bits;
  std::uint8_t* pages;
  std::array<std::uint64_t, 3> mask;
};

#ifdef OCTOSURF_HAS_LANES

/// `width` rays side by side in vector registers.
template <std::size_t width>
struct alignas(8 * width) RayLanes {
  double t[3][width]{}, dt[3][width]{};
  std::uint64_t step[3][width]{};  // address increment along each axis
  std::uint64_t address[width]{};
  std::int64_t left[width]{};  // remaining steps
};

inline long long as_signed(std::uint64_t v) { return static_cast<long long>(v); }

template <bool paged, std::size_t width>
[[gnu::always_inline]] inline void set_bits(const BitTarget& to, std::uint64_t (&word)[width],
                                            std::uint64_t (&bit)[width]) {
  // Forces a read from memory: GCC at -O3 would extract each lane from its register instead, which is five
  // times as slow on some processors (Zen 4, AVX-512: 5.2 and 1.0 ns a step).
  asm volatile("" : "+m"(word), "+m"(bit));
  for (std::size_t lane = 0; lane < width; ++lane) to.bits[word[lane]] |= bit[lane];
  if constexpr (paged)
    for (std::size_t lane = 0; lane < width; ++lane) to.pages[word[lane] >> 9] = 1;
}

/// Steps four lanes until the first arrives: sets the bits of the current voxels, then moves each lane along
/// the axis that GridWalk::next_axis would choose.
template <bool paged>
[[gnu::target("avx2")]] void advance(const BitTarget& to, RayLanes<4>& lanes) {
  __m256d tx = _mm256_load_pd(lanes.t[0]), ty = _mm256_load_pd(lanes.t[1]), tz = _mm256_load_pd(lanes.t[2]);
  const __m256d dx = _mm256_load_pd(lanes.dt[0]), dy = _mm256_load_pd(lanes.dt[1]),
                dz = _mm256_load_pd(lanes.dt[2]);
  const auto at = [](const void* p) { return static_cast<const __m256i*>(p); };
  const __m256i ex = _mm256_load_si256(at(lanes.step[0])), ey = _mm256_load_si256(at(lanes.step[1])),
                ez = _mm256_load_si256(at(lanes.step[2]));
  __m256i address = _mm256_load_si256(at(lanes.address));
  const __m256i mx = _mm256_set1_epi64x(as_signed(to.mask[0])),
                my = _mm256_set1_epi64x(as_signed(to.mask[1])),
                mz = _mm256_set1_epi64x(as_signed(to.mask[2])), low6 = _mm256_set1_epi64x(63),
                one = _mm256_set1_epi64x(1), ones = _mm256_set1_epi64x(-1);
  const std::int64_t n = *std::min_element(lanes.left, lanes.left + 4);
  for (std::int64_t i = 0; i < n; ++i) {
    alignas(32) std::uint64_t word[4], bit[4];
    _mm256_store_si256(reinterpret_cast<__m256i*>(word), _mm256_srli_epi64(address, 6));
    _mm256_store_si256(reinterpret_cast<__m256i*>(bit),
                       _mm256_sllv_epi64(one, _mm256_and_si256(address, low6)));
    set_bits<paged>(to, word, bit);
    const __m256d xy = _mm256_cmp_pd(tx, ty, _CMP_LT_OQ), xz = _mm256_cmp_pd(tx, tz, _CMP_LT_OQ),
                  yz = _mm256_cmp_pd(ty, tz, _CMP_LT_OQ);
    const __m256d is_x = _mm256_and_pd(xy, xz), is_y = _mm256_andnot_pd(xy, yz);
    const __m256d is_z = _mm256_andnot_pd(_mm256_or_pd(is_x, is_y), _mm256_castsi256_pd(ones));
    tx = _mm256_add_pd(tx, _mm256_and_pd(dx, is_x));
    ty = _mm256_add_pd(ty, _mm256_and_pd(dy, is_y));
    tz = _mm256_add_pd(tz, _mm256_and_pd(dz, is_z));
    const __m256i x = _mm256_castpd_si256(is_x), y = _mm256_castpd_si256(is_y);
    const __m256i m = _mm256_blendv_epi8(_mm256_blendv_epi8(mz, my, y), mx, x);
    const __m256i step = _mm256_blendv_epi8(_mm256_blendv_epi8(ez, ey, y), ex, x);
    const __m256i moved = _mm256_add_epi64(_mm256_or_si256(address, _mm256_andnot_si256(m, ones)), step);
    address = _mm256_or_si256(_mm256_and_si256(moved, m), _mm256_andnot_si256(m, address));
  }
  _mm256_store_pd(lanes.t[0], tx), _mm256_store_pd(lanes.t[1], ty), _mm256_store_pd(lanes.t[2], tz);
  _mm256_store_si256(reinterpret_cast<__m256i*>(lanes.address), address);
  for (std::int64_t& left : lanes.left) left -= n;
}

/// The same with eight.
template <bool paged>
[[gnu::target("avx512f,avx512dq")]] void advance(const BitTarget& to, RayLanes<8>& lanes) {
  __m512d tx = _mm512_load_pd(lanes.t[0]), ty = _mm512_load_pd(lanes.t[1]), tz = _mm512_load_pd(lanes.t[2]);
  const __m512d dx = _mm512_load_pd(lanes.dt[0]), dy = _mm512_load_pd(lanes.dt[1]),
                dz = _mm512_load_pd(lanes.dt[2]);
  const __m512i ex = _mm512_load_si512(lanes.step[0]), ey = _mm512_load_si512(lanes.step[1]),
                ez = _mm512_load_si512(lanes.step[2]);
  __m512i address = _mm512_load_si512(lanes.address);
  const __m512i mx = _mm512_set1_epi64(as_signed(to.mask[0])), my = _mm512_set1_epi64(as_signed(to.mask[1])),
                mz = _mm512_set1_epi64(as_signed(to.mask[2])), low6 = _mm512_set1_epi64(63),
                one = _mm512_set1_epi64(1);
  constexpr __mmask8 all = 0xff;  // GCC 12 warns that unmasked shifts read uninitialised values
  const std::int64_t n = *std::min_element(lanes.left, lanes.left + 8);
  for (std::int64_t i = 0; i < n; ++i) {
    alignas(64) std::uint64_t word[8], bit[8];
    _mm512_store_si512(word, _mm512_maskz_srli_epi64(all, address, 6));
    _mm512_store_si512(bit, _mm512_maskz_sllv_epi64(all, one, _mm512_and_si512(address, low6)));
    set_bits<paged>(to, word, bit);
    // As next_axis chooses, without waiting for one mask to find the next.
    const __mmask8 is_x = _mm512_cmp_pd_mask(tx, _mm512_maskz_min_pd(all, ty, tz), _CMP_LT_OQ),
                   is_y = _kand_mask8(_mm512_cmp_pd_mask(ty, tz, _CMP_LT_OQ),
                                      _mm512_cmp_pd_mask(ty, tx, _CMP_LE_OQ)),
                   is_z = _mm512_cmp_pd_mask(tz, _mm512_maskz_min_pd(all, tx, ty), _CMP_LE_OQ);
    tx = _mm512_mask_add_pd(tx, is_x, tx, dx);
    ty = _mm512_mask_add_pd(ty, is_y, ty, dy);
    tz = _mm512_mask_add_pd(tz, is_z, tz, dz);
    const __m512i m = _mm512_mask_mov_epi64(_mm512_mask_mov_epi64(mz, is_y, my), is_x, mx);
    const __m512i step = _mm512_mask_mov_epi64(_mm512_mask_mov_epi64(ez, is_y, ey), is_x, ex);
    constexpr int or_not = 0xf5, choose = 0xca;  // ternary-logic truth tables: a | ~c; a ? b : c
    const __m512i moved = _mm512_add_epi64(_mm512_ternarylogic_epi64(address, address, m, or_not), step);
    address = _mm512_ternarylogic_epi64(m, moved, address, choose);
  }
  _mm512_store_pd(lanes.t[0], tx), _mm512_store_pd(lanes.t[1], ty), _mm512_store_pd(lanes.t[2], tz);
  _mm512_store_si512(lanes.address, address);
  for (std::int64_t& left : lanes.left) left -= n;
}

#endif

/// Walks rays that all start in one voxel and take GridWalk::steps steps each, setting a bit for every voxel
/// they leave. Eight or four rays run in parallel lanes where the processor has AVX-512 or AVX2, because a
/// single ray stalls on its own comparison at every step. Additions and comparisons equal those of the scalar
/// walk, so the bits do too.
class LaneWalker {
 public:
  LaneWalker(const BitTarget& to, std::uint64_t start) : to_(to), start_(start) {}

  /// next(GridWalk&) fetches the next ray; false: none is left.
  template <class Next>
  void run(Next&& next) {
    if (supports(8))
      run_abreast<8>(next);
    else if (supports(4))
      run_abreast<4>(next);
    else
      run_abreast<1>(next);
  }

  /// Whether this processor can walk `width` rays in parallel; 1 everywhere.
  static bool supports(std::size_t width) {
#ifdef OCTOSURF_HAS_LANES
    if (width == 8) return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
    if (width == 4) return __builtin_cpu_supports("avx2");
#endif
    return width == 1;
  }
  /// run() with `width` lanes; needs supports(width).
  template <std::size_t width, class Next>
  void run_abreast(Next&& next) {
#ifdef OCTOSURF_HAS_LANES
    if constexpr (width > 1) run_lanes<width>(next);
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
  template <std::size_t width, class Next>
  void run_lanes(Next& next) {
    RayLanes<width> lanes;
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
  template <std::size_t width>
  void fill(RayLanes<width>& lanes, std::size_t lane, const GridWalk& walk) const {
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
