#include "occupancy/point_window.hpp"

namespace octosurf::occupancy {

std::uint32_t PointWindow::look_up(std::uint64_t packed_block) const {
  const auto [entry, fresh] = index_.try_emplace(packed_block, static_cast<std::uint32_t>(blocks_.size()));
  last_asked_ = packed_block;
  last_block_ = entry->second;
  if (fresh) read_block(packed_block);
  return last_block_;
}

void PointWindow::read_block(std::uint64_t packed_block) const {
  const geometry::VoxelKey base{static_cast<std::uint16_t>((packed_block & 0x1fff) << 3),
                                static_cast<std::uint16_t>((packed_block >> 16 & 0x1fff) << 3),
                                static_cast<std::uint16_t>((packed_block >> 32 & 0x1fff) << 3)};
  scratch_.clear();
  read_(base, scratch_);
  Block& block = blocks_.emplace_back();
  block.around.fill(unknown);
  block.first = static_cast<std::uint32_t>(points_.size());
  block.count = static_cast<std::uint32_t>(scratch_.size());
  if (scratch_.empty()) return;
  for (const VoxelPoint& p : scratch_)
    block.slices[p.key.z & 7] |= std::uint64_t{1} << (8 * (p.key.y & 7) + (p.key.x & 7));
  std::uint16_t before = 0;
  for (std::size_t z = 0; z < 8; ++z) {
    std::uint64_t sum = 0;  // byte y: points in rows up to y
    for (unsigned y = 0; y < 8; ++y)
      sum += bits_in_row[block.slices[z] >> (8 * y) & 0xff] * (0x0101010101010101ULL << (8 * y));
    block.rows_before[z] = sum << 8;
    block.slices_before[z] = before;
    before = static_cast<std::uint16_t>(before + (sum >> 56));
  }
  points_.resize(points_.size() + scratch_.size());
  for (const VoxelPoint& p : scratch_) points_[index_in(block, p.key)] = p;
}

}  // namespace octosurf::occupancy
