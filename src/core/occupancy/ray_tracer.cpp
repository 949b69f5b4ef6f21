#include "occupancy/ray_tracer.hpp"

#include <algorithm>
#include <bit>
#include <span>

namespace octosurf::occupancy {
namespace {

/// One ray per distinct end voxel; those beyond the range end there and hit nothing.
std::vector<GridRay> rays_of(const sensing::VoxelScan& scan, const geometry::VoxelGrid& grid) {
  std::vector<GridRay> rays;
  rays.reserve(scan.ends.size());
  for (const sensing::EndVoxel& end : scan.ends) {
    const Eigen::Vector3f centre = grid.centre_of(end.key);
    if (scan.within_range(centre)) {
      rays.push_back({{centre.x(), centre.y(), centre.z()}, {end.key.x, end.key.y, end.key.z}, true, true});
      continue;
    }
    Eigen::Vector3f direction = centre - scan.origin;
    direction /= static_cast<float>(sensing::norm_of(direction.x(), direction.y(), direction.z()));
    const Eigen::Vector3f cut = scan.origin + direction * static_cast<float>(scan.max_range);
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

}  // namespace

TouchedVoxels RayTracer::operator()(const sensing::VoxelScan& scan, const sensing::Downsampler& index,
                                    int threads) {
  GridOrigin from{{scan.origin.x(), scan.origin.y(), scan.origin.z()}, {}, grid_.resolution()};
  geometry::VoxelKey key;
  grid_.key_of(scan.origin, key);
  from.key = {key.x, key.y, key.z};
  TouchedVoxels touched = copy_of(bits_.trace(from, rays_of(scan, grid_), threads));
  bits_.clear();
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
