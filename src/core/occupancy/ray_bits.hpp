#pragma once

#include "occupancy/block_bits.hpp"
#include "occupancy/grid_ray.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <octosurf/adapters/detail/scan_rays.hpp>

namespace octosurf::occupancy {

using detail::TouchedBlock;

/// The voxels one scan hits and misses, as OctoMap's discretised insertion would list them, with no
/// hash of voxels: rays set bits in an array over the scan's box whose cache lines are blocks of the
/// octree, so that neighbouring rays and following steps mostly meet the same line.
///
/// A box over 2^31 voxels (20 m around the sensor at 2 cm) is cut to a core around the sensor; rays that
/// leave the core go a slower way through a hash of blocks, so that stray far returns cost what they
/// cross and no more. Memory: a bit a voxel for misses and one for hits, in pages of 32³ voxels that were
/// ever touched; 256 MB each at most, and as much for misses again for every further thread.
class RayBits {
 public:
  /// Touched blocks in ascending Morton order; valid until the next call. The result does not depend
  /// on `threads`. Cost: ray steps (about 0.8 ns each) plus one pass over the box's blocks.
  std::span<const TouchedBlock> trace(const GridOrigin& from, std::span<const GridRay> rays, int threads);
  /// Drops these blocks, as trace() does first; sooner, while they are in the processor's caches, is faster.
  void clear();

 private:
  struct Marks {
    LazyWords misses;
    std::vector<std::uint8_t> pages;   // 32³ voxels that a ray met, in large boxes only
    std::vector<const GridRay*> slow;  // rays for walk_slowly
  };
  void set_core(const GridOrigin& from, std::span<const GridRay> rays);
  void walk(Marks& marks, const GridOrigin& from, std::span<const GridRay> rays) const;
  void walk_slowly(const GridOrigin& from, const GridRay& ray);
  void mark_hits(std::span<const GridRay> rays);
  void collect(unsigned level, unsigned x, unsigned y, unsigned z, int threads);
  void collect_block(unsigned x, unsigned y, unsigned z, int threads);
  void add_block(std::uint64_t morton, std::uint64_t* misses, std::uint64_t* hits);
  void collect_strays();
  std::uint64_t* stray_word(const std::array<std::uint16_t, 3>& key, bool hit);

  static constexpr unsigned core_bits = 31, small_bits = 27;
  KeyBox core_;
  BlockAddress address_;
  bool paged_ = false;
  std::vector<Marks> marks_{1};
  LazyWords hits_;
  std::unordered_map<std::uint64_t, StrayBlock> strays_;  // by Morton index
  std::vector<TouchedBlock> blocks_;
  bool unfinished_ = false;  // an exception has left bits behind that blocks_ does not list
};

}  // namespace octosurf::occupancy
