#include "occupancy/ray_bits.hpp"
#include "occupancy/voxel_tree.hpp"
#include "sensing/voxel_table.hpp"

namespace octosurf::detail {

struct ScanRays::Parts {
  std::vector<occupancy::GridRay> rays;
  occupancy::RayBits bits;
  sensing::VoxelTable ends;
};

ScanRays::ScanRays() : parts_(std::make_unique<Parts>()) {}
ScanRays::~ScanRays() = default;

void ScanRays::clear() {
  parts_->rays.clear();
  parts_->ends.clear();
}

bool ScanRays::is_new_end(const std::array<std::uint16_t, 3>& key) { return parts_->ends.at(key)++ == 0; }

void ScanRays::add(const std::array<float, 3>& end, const std::array<std::uint16_t, 3>& key, bool hit,
                   bool to_centre) {
  parts_->rays.push_back({end, key, hit, to_centre});
}

std::span<const TouchedBlock> ScanRays::trace(const std::array<float, 3>& position,
                                              const std::array<std::uint16_t, 3>& key, double resolution,
                                              int threads) {
  return parts_->bits.trace({position, key, resolution}, parts_->rays, threads);
}

std::array<std::uint16_t, 3> voxel_of(const TouchedBlock& block, unsigned i) {
  const auto [x, y, z] = occupancy::VoxelTree::key_of(block.morton << 9 | i);
  return {x, y, z};
}

}  // namespace octosurf::detail
