#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>

namespace octosurf::detail {

/// 8³ voxels that a scan touched: bit m of the masks is the voxel with Morton index m inside the
/// block, so that word w and its bytes are the octree's children and grandchildren.
struct TouchedBlock {
  std::uint64_t morton = 0;         ///< of the block's key (voxel key / 8), 13 bits an axis
  std::uint64_t* misses = nullptr;  ///< eight words; never overlap hits
  std::uint64_t* hits = nullptr;    ///< eight words
  bool hit = false;                 ///< some bit of `hits` is set
};

inline bool any_hit(std::span<const TouchedBlock> blocks) {
  return std::any_of(blocks.begin(), blocks.end(), [](const TouchedBlock& block) { return block.hit; });
}

/// visit(child, blocks) for every child of a node that blocks below it touch; the node's blocks, in
/// ascending Morton order, agree in the bits above `shift` + 3.
template <class Visit>
void for_each_touched_child(std::span<const TouchedBlock> blocks, int shift, Visit&& visit) {
  for (std::size_t begin = 0; begin < blocks.size();) {
    const auto child = static_cast<unsigned>(blocks[begin].morton >> shift & 7);
    std::size_t end = begin + 1;
    while (end < blocks.size() && (blocks[end].morton >> shift & 7) == child) ++end;
    visit(child, blocks.subspan(begin, end - begin));
    begin = end;
  }
}

/// The map's ray walker (src/core/occupancy/ray_bits.hpp) for octrees of others: the voxels that a scan's
/// rays hit and miss. Memory is kept from scan to scan.
class ScanRays {
 public:
  ScanRays();
  ~ScanRays();

  /// Begins a scan.
  void clear();
  /// Whether no earlier call since clear() named this voxel.
  bool is_new_end(const std::array<std::uint16_t, 3>& key);
  /// A ray to `end` (map frame, m) in the voxel `key`, as OctoMap's OcTreeKey: hit, unless the ray was cut
  /// there. `to_centre`: `end` is the voxel's centre.
  void add(const std::array<float, 3>& end, const std::array<std::uint16_t, 3>& key, bool hit,
           bool to_centre);
  /// Blocks in ascending Morton order that the rays from `position` in the voxel `key` touch; valid until the
  /// next call.
  std::span<const TouchedBlock> trace(const std::array<float, 3>& position,
                                      const std::array<std::uint16_t, 3>& key, double resolution,
                                      int threads);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The voxel with Morton index i inside the block.
std::array<std::uint16_t, 3> voxel_of(const TouchedBlock& block, unsigned i);

}  // namespace octosurf::detail
