#include "detection/voxel_blocks.hpp"

namespace octosurf::detection {
namespace {

void sort_unique(std::vector<VoxelBlocks::Place>& places) {
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

}  // namespace

std::vector<VoxelBlocks::Place> VoxelBlocks::widened(std::vector<Place> places, int voxels) const {
  sort_unique(places);
  const int reach = (voxels + edge_ - 1) / edge_, last = 65535 / edge_;
  for (unsigned shift = 0; shift < 48; shift += 16) {  // axis by axis
    std::vector<Place> wide;
    wide.reserve(places.size() * static_cast<std::size_t>(2 * reach + 1));
    for (const Place place : places) {
      const int at = static_cast<int>(place >> shift & 0xffff);
      for (int k = std::max(0, at - reach); k <= std::min(last, at + reach); ++k)
        wide.push_back((place & ~(std::uint64_t{0xffff} << shift)) | static_cast<std::uint64_t>(k) << shift);
    }
    sort_unique(wide);
    places = std::move(wide);
  }
  return places;
}

}  // namespace octosurf::detection
