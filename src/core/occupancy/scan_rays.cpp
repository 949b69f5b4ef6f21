#include "occupancy/ray_bits.hpp"
#include "occupancy/voxel_tree.hpp"
#include "sensing/voxel_table.hpp"

namespace octosurf::detail {

struct ScanRays::Parts {
  occupancy::RayBits bits;
  sensing::VoxelTable ends;
};

ScanRays::ScanRays() : parts_(std::make_unique<Parts>()) {}
ScanRays::~ScanRays() = default;

void ScanRays::clear() {
  rays.clear();
  parts_->ends.clear();
}

bool ScanRays::is_new_end(const std::array<std::uint16_t, 3>& key) { return parts_->ends.at(key)++ == 0; }

std::span<const TouchedBlock> ScanRays::trace(const GridOrigin& from, int threads) {
  return parts_->bits.trace(from, rays, threads);
}

std::array<std::uint16_t, 3> voxel_of(const TouchedBlock& block, unsigned i) {
  const auto [x, y, z] = occupancy::VoxelTree::key_of(block.morton << 9 | i);
  return {x, y, z};
}

}  // namespace octosurf::detail
