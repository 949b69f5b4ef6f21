#include "occupancy/point_window.hpp"

namespace octosurf {

PointWindow::Index PointWindow::find(VoxelKey key) {
  const Block& block = blocks_[block_of(key.packed() >> 3 & block_mask)];
  const bool present = block.slices[key.z & 7] >> (8 * (key.y & 7) + (key.x & 7)) & 1;
  return present ? index_in(block, key) : none;
}

PointWindow::Index PointWindow::index_in(const Block& block, VoxelKey key) {
  const unsigned y = key.y & 7, z = key.z & 7;
  const auto row = static_cast<unsigned>(block.slices[z] >> (8 * y) & 0xff);
  return block.first + block.before[8 * z + y] + bits_in_row[row & ((1U << (key.x & 7)) - 1)];
}

std::uint32_t PointWindow::block_of(std::uint64_t packed_block) {
  const auto [entry, fresh] = index_.try_emplace(packed_block, static_cast<std::uint32_t>(blocks_.size()));
  if (!fresh) return entry->second;
  const VoxelKey base{static_cast<std::uint16_t>((packed_block & 0x1fff) << 3),
                      static_cast<std::uint16_t>((packed_block >> 16 & 0x1fff) << 3),
                      static_cast<std::uint16_t>((packed_block >> 32 & 0x1fff) << 3)};
  scratch_.clear();
  map_.read_block(base, scratch_);
  Block block;
  block.first = static_cast<Index>(points_.size());
  block.count = static_cast<Index>(scratch_.size());
  for (const VoxelPoint& p : scratch_)
    block.slices[p.key.z & 7] |= std::uint64_t{1} << (8 * (p.key.y & 7) + (p.key.x & 7));
  for (std::size_t row = 1; row < 64; ++row) {
    const auto previous = static_cast<unsigned>(block.slices[(row - 1) / 8] >> (8 * ((row - 1) % 8)) & 0xff);
    block.before[row] = static_cast<std::uint16_t>(block.before[row - 1] + bits_in_row[previous]);
  }
  points_.resize(points_.size() + scratch_.size());
  for (const VoxelPoint& p : scratch_) points_[index_in(block, p.key)] = p;
  blocks_.push_back(block);
  return entry->second;
}

}  // namespace octosurf
