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

std::map<VoxelBlocks::Place, occupancy::KeyBox> VoxelBlocks::boxes(const occupancy::PointWindow& window,
                                                                   std::span<const PointId> points,
                                                                   int voxels) const {
  std::map<Place, occupancy::KeyBox> boxes;
  auto last = boxes.end();  // points of a block mostly follow each other
  for (const PointId point : points) {
    const geometry::VoxelKey voxel = window[point].key;
    const occupancy::Key3 key = occupancy::ints(voxel);
    if (last == boxes.end() || last->first != of(voxel))
      last = boxes.try_emplace(of(voxel), occupancy::KeyBox{key, key}).first;
    occupancy::KeyBox& box = last->second;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], std::max(0, key[axis] - voxels));
      box.high[axis] = std::max(box.high[axis], std::min(geometry::VoxelGrid::last, key[axis] + voxels));
    }
  }
  return boxes;
}

}  // namespace octosurf::detection
