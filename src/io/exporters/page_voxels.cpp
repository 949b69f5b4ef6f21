#include "io/exporters/page_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

/// An occupied voxel, or several merged to a larger one.
struct PageVoxel {
  std::array<int, 3> zyx{};  ///< its corner over its edge
  float log_odds = 0;
  SurfaceId surface = 0;
};

/// All occupied voxels, by z, then y, then x.
std::vector<PageVoxel> occupied_voxels(const OccupancyView& octree) {
  std::vector<PageVoxel> voxels;
  const double d = octree.resolution();
  if (d == 0) return voxels;
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  octree.for_each_occupied({-far, far}, [&](const OccupancyView::Voxel& voxel) {
    const Eigen::Vector3i at = (voxel.center / d).array().floor().cast<int>();
    voxels.push_back({{at.z(), at.y(), at.x()}, voxel.log_odds, voxel.surface});
    return true;
  });
  std::ranges::sort(voxels, {}, &PageVoxel::zyx);
  return voxels;
}

/// Of each cube of 2³ voxels the one with the highest log-odds, as large as the cube.
void merge_voxels(std::vector<PageVoxel>& voxels) {
  for (PageVoxel& voxel : voxels)
    for (int& key : voxel.zyx) key >>= 1;  // rounds down
  std::stable_sort(voxels.begin(), voxels.end(), [](const PageVoxel& a, const PageVoxel& b) {
    return std::tuple(a.zyx, -a.log_odds) < std::tuple(b.zyx, -b.log_odds);
  });
  const auto [rest, end] = std::ranges::unique(voxels, {}, &PageVoxel::zyx);
  voxels.erase(rest, end);
}

/// Each number less the one before it, modulo 2¹⁶: small numbers compress well.
std::vector<std::uint16_t> differences(std::vector<std::uint16_t> numbers) {
  std::adjacent_difference(
      numbers.begin(), numbers.end(), numbers.begin(),
      [](std::uint16_t number, std::uint16_t before) { return static_cast<std::uint16_t>(number - before); });
  return numbers;
}

void add_voxels(PageBlock& block, const std::vector<PageVoxel>& voxels, double size) {
  if (voxels.empty()) return;
  PageVoxel low = voxels.front();
  float least = low.log_odds, greatest = low.log_odds;
  for (const PageVoxel& voxel : voxels) {
    for (std::size_t k = 0; k < 3; ++k) low.zyx[k] = std::min(low.zyx[k], voxel.zyx[k]);
    least = std::min(least, voxel.log_odds);
    greatest = std::max(greatest, voxel.log_odds);
  }
  constexpr float steps = std::numeric_limits<std::uint8_t>::max();
  const float step = greatest > least ? (greatest - least) / steps : 1;
  std::array<std::vector<std::uint16_t>, 3> places;
  std::vector<std::uint8_t> log_odds;
  std::vector<SurfaceId> surfaces;
  for (const PageVoxel& voxel : voxels) {
    for (std::size_t k = 0; k < 3; ++k)  // an octree is 65536 voxels wide
      places[k].push_back(static_cast<std::uint16_t>(voxel.zyx[k] - low.zyx[k]));
    log_odds.push_back(static_cast<std::uint8_t>(std::lround((voxel.log_odds - least) / step)));
    surfaces.push_back(voxel.surface);
  }
  block.json["voxels"] = {{"size", size},
                          {"low", Json::array({low.zyx[2], low.zyx[1], low.zyx[0]})},
                          {"least_log_odds", least},
                          {"log_odds_step", step}};
  block.add("voxel_x", differences(places[2]));
  block.add("voxel_y", differences(places[1]));
  block.add("voxel_z", differences(places[0]));
  block.add("voxel_log_odds", log_odds);
  block.add("voxel_surface", surfaces);
}

}  // namespace

std::string voxels_message(const PageMap& map, double most_bytes) {
  std::vector<PageVoxel> voxels = occupied_voxels(map.octree);
  const std::size_t before_merging = voxels.size();
  for (int merged = 1;; merged *= 2) {
    if (merged > 32) {
      merged = 0;
      voxels.clear();
    } else if (merged > 1) {
      merge_voxels(voxels);
    }
    PageBlock block;
    block.json["kind"] = "voxels";
    block.json["revision"] = map.snapshot->revision;
    block.json["merged"] = merged;
    block.json["voxels_before_merging"] = before_merging;
    add_voxels(block, voxels, map.octree.resolution() * merged);
    std::string message = block.packed();
    if (merged == 0 || static_cast<double>(message.size()) <= most_bytes) return message;
  }
}

}  // namespace octosurf::io
