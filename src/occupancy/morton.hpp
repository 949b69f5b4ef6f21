#pragma once

#include <array>
#include <cstdint>

namespace octosurf {

/// Spreads the low 21 bits of v to every third bit.
inline std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffULL;
  v = (v | v << 16) & 0x1f0000ff0000ffULL;
  v = (v | v << 8) & 0x100f00f00f00f00fULL;
  v = (v | v << 4) & 0x10c30c30c30c30c3ULL;
  return (v | v << 2) & 0x1249249249249249ULL;
}
inline std::uint32_t compact_bits(std::uint64_t v) {
  v &= 0x1249249249249249ULL;
  v = (v ^ (v >> 2)) & 0x10c30c30c30c30c3ULL;
  v = (v ^ (v >> 4)) & 0x100f00f00f00f00fULL;
  v = (v ^ (v >> 8)) & 0x1f0000ff0000ffULL;
  v = (v ^ (v >> 16)) & 0x1f00000000ffffULL;
  return static_cast<std::uint32_t>((v ^ (v >> 32)) & 0x1fffff);
}

/// Bits z y x interleaved: three bits are OctoMap's child index of one level.
inline std::uint64_t morton_of(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

/// Puts a row of eight voxels (bit x) at (y, z) of an 8³ block to its Morton places in `words`.
inline void spread_row(std::uint8_t row, unsigned y, unsigned z, std::array<std::uint64_t, 8>& words) {
  // x0 and x1 of a nibble go to Morton bits 0 and 3 of a word: voxels 0, 1, 8, 9.
  static constexpr std::array<std::uint16_t, 16> spread{0x000, 0x001, 0x002, 0x003, 0x100, 0x101,
                                                        0x102, 0x103, 0x200, 0x201, 0x202, 0x203,
                                                        0x300, 0x301, 0x302, 0x303};
  const unsigned word = (z >> 2) << 2 | (y >> 2) << 1;
  const unsigned shift = ((z >> 1) & 1) << 5 | ((y >> 1) & 1) << 4 | (z & 1) << 2 | (y & 1) << 1;
  words[word] |= std::uint64_t{spread[row & 15]} << shift;
  words[word + 1] |= std::uint64_t{spread[row >> 4]} << shift;
}

/// Voxel of an 8³ block with Morton index m, as offsets 0 … 7.
struct BlockOffset {
  std::uint16_t x, y, z;
};
inline BlockOffset block_offset(unsigned m) {
  return {static_cast<std::uint16_t>((m & 1) | (m >> 2 & 2) | (m >> 4 & 4)),
          static_cast<std::uint16_t>((m >> 1 & 1) | (m >> 3 & 2) | (m >> 5 & 4)),
          static_cast<std::uint16_t>((m >> 2 & 1) | (m >> 4 & 2) | (m >> 6 & 4))};
}

}  // namespace octosurf
