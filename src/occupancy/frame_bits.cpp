#include "occupancy/frame_bits.hpp"

#include "occupancy/morton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace octosurf {
namespace {

constexpr std::int64_t max_slab_bits = std::int64_t{1} << 31;

int floor8(int v) { return v & ~7; }

float length_of(const Eigen::Vector3f& v) {
  return static_cast<float>(std::sqrt(static_cast<double>(v.x() * v.x() + v.y() * v.y() + v.z() * v.z())));
}

}  // namespace

void FrameBits::collect_rays(const VoxelScan& scan) {
  rays_.clear();
  VoxelKey key;
  grid_.key_of(scan.origin, key);
  box_ = {{key.x, key.y, key.z}, {key.x, key.y, key.z}};
  const auto extend = [this](VoxelKey k) {
    const std::array<int, 3> v{k.x, k.y, k.z};
    for (std::size_t a = 0; a < 3; ++a) {
      box_.min[a] = std::min(box_.min[a], v[a]);
      box_.max[a] = std::max(box_.max[a], v[a]);
    }
  };
  for (const EndVoxel& end : scan.ends) {
    const Eigen::Vector3f centre = grid_.centre_of(end.key);
    if (scan.within_range(centre)) {
      rays_.push_back({centre, end.key, false});
      extend(end.key);
      continue;
    }
    Eigen::Vector3f direction = centre - scan.origin;
    direction /= length_of(direction);
    const Eigen::Vector3f cut = scan.origin + direction * static_cast<float>(scan.max_range);
    if (VoxelKey k; grid_.key_of(cut, k)) {
      rays_.push_back({cut, k, true});
      extend(k);
    }
  }
  // A cut ray can step one voxel past its end before the length stops it.
  for (std::size_t a = 0; a < 3; ++a) {
    box_.min[a] = std::max(0, box_.min[a] - 1);
    box_.max[a] = std::min(65535, box_.max[a] + 1);
  }
}

void FrameBits::set_slab(int z_begin, int z_end) {
  base_ = {floor8(box_.min[0]), floor8(box_.min[1]), z_begin};
  size_ = {(box_.max[0] - base_[0]) / 64 * 64 + 64, floor8(box_.max[1] - base_[1]) + 8, z_end - z_begin};
  const auto words = static_cast<std::size_t>(size_[0] * size_[1] * size_[2] / 64);
  miss_bits_.assign(words, 0);
  hit_bits_.assign(words, 0);
}

template <bool clipped>
void FrameBits::walk(const Ray& ray, const Eigen::Vector3f& origin, VoxelKey origin_key) {
  if (ray.end_key == origin_key) return;
  const std::array<int, 3> from{origin_key.x, origin_key.y, origin_key.z};
  const std::array<int, 3> to{ray.end_key.x, ray.end_key.y, ray.end_key.z};
  const std::array<std::int64_t, 3> stride{1, size_[0], size_[0] * size_[1]};
  Eigen::Vector3f direction = ray.end - origin;
  const float length = length_of(direction);
  direction /= length;

  std::array<double, 3> t_max, t_delta;
  std::array<std::int64_t, 3> step;
  std::int64_t index = 0, steps = 0;
  int z_step = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const int sign = direction[static_cast<int>(a)] > 0 ? 1 : direction[static_cast<int>(a)] < 0 ? -1 : 0;
    const double d = direction[static_cast<int>(a)];
    if (sign != 0) {
      double border = (static_cast<double>(from[a] - VoxelGrid::origin) + 0.5) * grid_.resolution();
      border += static_cast<float>(sign * grid_.resolution() * 0.5);
      t_max[a] = (border - static_cast<double>(origin[static_cast<int>(a)])) / d;
      t_delta[a] = grid_.resolution() / std::fabs(d);
    } else {
      t_max[a] = t_delta[a] = std::numeric_limits<double>::max();
    }
    step[a] = sign * stride[a];
    if (a == 2) z_step = sign;
    index += (from[a] - base_[a]) * stride[a];
    steps += std::abs(to[a] - from[a]);
  }

  std::uint64_t* bits = miss_bits_.data();
  int z = from[2] - base_[2];
  const auto mark = [&] {
    if (!clipped || (z >= 0 && z < size_[2])) bits[index >> 6] |= std::uint64_t{1} << (index & 63);
  };
  const auto advance = [&] {
    const std::size_t a = t_max[0] < t_max[1] ? (t_max[0] < t_max[2] ? 0 : 2) : (t_max[1] < t_max[2] ? 1 : 2);
    index += step[a];
    if (clipped && a == 2) z += z_step;
    t_max[a] += t_delta[a];
  };
  if (!ray.cut) {
    for (; steps > 0; --steps) {
      mark();
      advance();
    }
    return;
  }
  std::int64_t end_index = 0;
  for (std::size_t a = 0; a < 3; ++a) end_index += (to[a] - base_[a]) * stride[a];
  mark();
  for (;;) {
    advance();
    if (index == end_index || std::min({t_max[0], t_max[1], t_max[2]}) > static_cast<double>(length)) return;
    mark();
  }
}

void FrameBits::mark_hits(const VoxelScan& scan) {
  for (const EndVoxel& end : scan.ends) {
    if (!scan.within_range(grid_.centre_of(end.key))) continue;
    const std::int64_t z = end.key.z - base_[2];
    if (z < 0 || z >= size_[2]) continue;
    const std::int64_t i = (z * size_[1] + (end.key.y - base_[1])) * size_[0] + (end.key.x - base_[0]);
    hit_bits_[static_cast<std::size_t>(i >> 6)] |= std::uint64_t{1} << (i & 63);
  }
}

void FrameBits::read_blocks() {
  const std::int64_t row_words = size_[0] / 64;
  const auto word_at = [&](std::int64_t wx, std::int64_t y, std::int64_t z) {
    return static_cast<std::size_t>((z * size_[1] + y) * row_words + wx);
  };
  for (std::int64_t z = 0; z < size_[2]; z += 8)
    for (std::int64_t y = 0; y < size_[1]; y += 8)
      for (std::int64_t wx = 0; wx < row_words; ++wx) {
        std::uint64_t any = 0;  // bytes of a word are the rows of eight blocks
        for (std::int64_t row = 0; row < 64; ++row) {
          const std::size_t w = word_at(wx, y + (row & 7), z + (row >> 3));
          any |= miss_bits_[w] | hit_bits_[w];
        }
        if (any == 0) continue;
        for (unsigned byte = 0; byte < 8; ++byte) {
          if (((any >> (8 * byte)) & 0xff) == 0) continue;
          TouchedBlock& block = blocks_.emplace_back();
          block.morton = morton_of(static_cast<std::uint32_t>((base_[0] + wx * 64) / 8 + byte),
                                   static_cast<std::uint32_t>((base_[1] + y) / 8),
                                   static_cast<std::uint32_t>((base_[2] + z) / 8));
          for (unsigned row = 0; row < 64; ++row) {
            const std::size_t w = word_at(wx, y + (row & 7), z + (row >> 3));
            const auto hits = static_cast<std::uint8_t>(hit_bits_[w] >> (8 * byte));
            const auto misses = static_cast<std::uint8_t>((miss_bits_[w] >> (8 * byte)) & ~hits);
            if (hits != 0) spread_row(hits, row & 7, row >> 3, block.hits);
            if (misses != 0) spread_row(misses, row & 7, row >> 3, block.misses);
          }
        }
      }
}

std::span<const TouchedBlock> FrameBits::trace(const VoxelScan& scan) {
  collect_rays(scan);
  blocks_.clear();
  VoxelKey origin_key;
  grid_.key_of(scan.origin, origin_key);

  const int z_begin = floor8(box_.min[2]);
  const int z_end = floor8(box_.max[2]) + 8;
  const std::int64_t plane_bits =
      std::int64_t{box_.max[0] - floor8(box_.min[0]) + 64} * (box_.max[1] - floor8(box_.min[1]) + 8);
  const auto slab = static_cast<int>(std::clamp<std::int64_t>(max_slab_bits / plane_bits / 8 * 8, 8, 65536));
  for (int z = z_begin; z < z_end; z += slab) {
    set_slab(z, std::min(z + slab, z_end));
    const bool whole = size_[2] == z_end - z_begin;
    for (const Ray& ray : rays_)
      whole ? walk<false>(ray, scan.origin, origin_key) : walk<true>(ray, scan.origin, origin_key);
    mark_hits(scan);
    read_blocks();
  }
  std::sort(blocks_.begin(), blocks_.end(),
            [](const TouchedBlock& a, const TouchedBlock& b) { return a.morton < b.morton; });
  return blocks_;
}

}  // namespace octosurf
