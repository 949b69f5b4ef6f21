#include "occupancy/ray_tracer.hpp"

#include <algorithm>
#include <bit>
#include <span>
#include <utility>

namespace octosurf::occupancy {
namespace {

/// One ray per distinct end voxel whose ray begins at this start; those beyond the range end there and hit
/// nothing, nor do free ones.
std::vector<GridRay> rays_of(const sensing::VoxelScan& scan, std::size_t start,
                             const geometry::VoxelGrid& grid) {
  std::vector<GridRay> rays;
  if (start == 0) rays.reserve(scan.ends.size());
  for (const sensing::EndVoxel& end : scan.ends) {
    if (end.start != start) continue;
    const Eigen::Vector3f& origin = scan.start_of(end);
    const Eigen::Vector3f centre = grid.centre_of(end.key);
    if (scan.within_range(end, centre)) {
      const bool hit = end.count > 0;
      rays.push_back({{centre.x(), centre.y(), centre.z()}, {end.key.x, end.key.y, end.key.z}, hit, hit});
      continue;
    }
    Eigen::Vector3f direction = centre - origin;
    direction /= static_cast<float>(sensing::norm_of(direction.x(), direction.y(), direction.z()));
    const Eigen::Vector3f cut = origin + direction * static_cast<float>(scan.max_range);
    if (geometry::VoxelKey key; grid.key_of(cut, key))
      rays.push_back({{cut.x(), cut.y(), cut.z()}, {key.x, key.y, key.z}, false, false});
  }
  return rays;
}

/// Blocks without hits, which are most, share eight empty words.
TouchedVoxels copy_of(std::span<const TouchedBlock> blocks) {
  constexpr std::size_t words = 8;
  const auto with_hits = static_cast<std::size_t>(std::ranges::count_if(blocks, &TouchedBlock::hit));
  TouchedVoxels copy{{blocks.begin(), blocks.end()},
                     std::make_unique_for_overwrite<std::uint64_t[]>(words * (1 + blocks.size() + with_hits)),
                     {}};
  std::uint64_t* const none = copy.masks.get();
  std::uint64_t* next = std::fill_n(none, words, 0);
  const auto take = [&next](const std::uint64_t* mask) {
    std::uint64_t* const place = next;
    next = std::copy_n(mask, words, place);
    return place;
  };
  for (TouchedBlock& block : copy.blocks) {
    block.misses = take(block.misses);
    block.hits = block.hit ? take(block.hits) : none;
  }
  return copy;
}

/// Union of the voxels touched; a hit overrides misses.
TouchedVoxels joined(const std::vector<TouchedVoxels>& parts) {
  std::vector<TouchedBlock> all;
  for (const TouchedVoxels& part : parts) all.insert(all.end(), part.blocks.begin(), part.blocks.end());
  std::ranges::stable_sort(all, {}, &TouchedBlock::morton);
  std::size_t last = 0;  // of the blocks joined so far, whose masks are the first part's own copies
  for (std::size_t i = 1; i < all.size(); ++i) {
    TouchedBlock& block = all[last];
    if (all[i].morton != block.morton) {
      all[++last] = all[i];
      continue;
    }
    if (all[i].hit && !block.hit)
      std::swap(block.hits, all[i].hits);  // those of blocks without hits are shared
    const bool both = all[i].hit && block.hit;
    block.hit = block.hit || all[i].hit;
    for (unsigned w = 0; w < 8; ++w) {
      block.misses[w] |= all[i].misses[w];
      if (both) block.hits[w] |= all[i].hits[w];
    }
  }
  if (!all.empty()) all.resize(last + 1);
  for (const TouchedBlock& block : all)
    for (unsigned w = 0; w < 8; ++w) block.misses[w] &= ~block.hits[w];
  return copy_of(all);
}

}  // namespace

TouchedVoxels RayTracer::trace(const sensing::VoxelScan& scan, std::size_t start, int threads) {
  const Eigen::Vector3f& origin = scan.starts.empty() ? scan.origin : scan.starts[start];
  GridOrigin from{{origin.x(), origin.y(), origin.z()}, {}, grid_.resolution()};
  geometry::VoxelKey key;
  grid_.key_of(origin, key);
  from.key = {key.x, key.y, key.z};
  TouchedVoxels touched = copy_of(bits_.trace(from, rays_of(scan, start, grid_), threads));
  bits_.clear();
  return touched;
}

TouchedVoxels RayTracer::operator()(const sensing::VoxelScan& scan, const sensing::Downsampler& index,
                                    int threads) {
  std::vector<TouchedVoxels> parts;
  for (std::size_t start = 0; start < std::max<std::size_t>(scan.starts.size(), 1); ++start)
    parts.push_back(trace(scan, start, threads));
  TouchedVoxels touched = parts.size() == 1 ? std::move(parts.front()) : joined(parts);
  touched.ends.reserve(scan.ends.size());
  for (const TouchedBlock& block : touched.blocks) {
    if (!block.hit) continue;
    for (unsigned w = 0; w < 8; ++w) {
      if (block.hits[w] == 0) continue;
      const auto [x, y, z] = detail::voxel_of(block, 64 * w);
      const sensing::VoxelTable::Cube& places = index.places_near({x, y, z});
      for (std::uint64_t m = block.hits[w]; m != 0; m &= m - 1)
        touched.ends.push_back(places[static_cast<std::size_t>(std::countr_zero(m))] - 1);
    }
  }
  return touched;
}

}  // namespace octosurf::occupancy
