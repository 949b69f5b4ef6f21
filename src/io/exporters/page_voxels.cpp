#include "io/exporters/page_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

std::tuple<int, int, int> place_of(const PageVoxel& voxel) { return {voxel.z, voxel.y, voxel.x}; }

int cell_of(double coordinate, double size) { return static_cast<int>(std::floor(coordinate / size)); }

/// The surface most of the voxels belong to, on a tie the lowest id.
SurfaceId most_frequent(std::vector<SurfaceId>& surfaces) {
  std::sort(surfaces.begin(), surfaces.end());
  SurfaceId best = 0;
  std::ptrdiff_t most = 0;
  for (auto at = surfaces.begin(); at != surfaces.end();) {
    const auto end = std::upper_bound(at, surfaces.end(), *at);
    if (end - at > most) {
      most = end - at;
      best = *at;
    }
    at = end;
  }
  return best;
}

/// A surface's place in the snapshot, from 1; 0: pending.
std::uint32_t number_of(SurfaceId id, const Snapshot& snapshot) {
  if (id == 0) return 0;
  const auto& all = snapshot.surfaces;
  const auto at = std::lower_bound(all.begin(), all.end(), id,
                                   [](const SurfacePtr& surface, SurfaceId i) { return surface->id < i; });
  return at != all.end() && (*at)->id == id ? static_cast<std::uint32_t>(at - all.begin()) + 1 : 0;
}

/// Differences of consecutive numbers, modulo the type's range: small numbers compress well.
template <typename Number>
std::vector<Number> differences(const std::vector<Number>& numbers) {
  using Unsigned = std::make_unsigned_t<Number>;
  std::vector<Number> result;
  result.reserve(numbers.size());
  Unsigned last = 0;
  for (const Number number : numbers) {
    const auto value = static_cast<Unsigned>(number);
    result.push_back(static_cast<Number>(static_cast<Unsigned>(value - last)));
    last = value;
  }
  return result;
}

std::vector<PageVoxel> merge_voxels(const std::vector<PageVoxel>& voxels, int times) {
  std::vector<PageVoxel> cells = voxels;
  const auto shrunk = [times](int key) { return key >= 0 ? key / times : -((times - 1 - key) / times); };
  for (PageVoxel& voxel : cells) {
    voxel.x = shrunk(voxel.x);
    voxel.y = shrunk(voxel.y);
    voxel.z = shrunk(voxel.z);
  }
  std::stable_sort(cells.begin(), cells.end(),
                   [](const PageVoxel& a, const PageVoxel& b) { return place_of(a) < place_of(b); });
  std::vector<PageVoxel> merged;
  std::vector<SurfaceId> surfaces;
  for (auto at = cells.begin(); at != cells.end();) {
    PageVoxel one = *at;
    surfaces.clear();
    for (; at != cells.end() && place_of(*at) == place_of(one); ++at) {
      one.log_odds = std::max(one.log_odds, at->log_odds);
      surfaces.push_back(at->surface);
    }
    one.surface = most_frequent(surfaces);
    merged.push_back(one);
  }
  return merged;
}

void add_voxels(PageBlock& block, const std::vector<PageVoxel>& voxels, double size,
                const Snapshot& snapshot) {
  if (voxels.empty()) return;
  PageVoxel low = voxels.front();
  float least = low.log_odds, greatest = low.log_odds;
  for (const PageVoxel& voxel : voxels) {
    low.x = std::min(low.x, voxel.x);
    low.y = std::min(low.y, voxel.y);
    low.z = std::min(low.z, voxel.z);
    least = std::min(least, voxel.log_odds);
    greatest = std::max(greatest, voxel.log_odds);
  }
  constexpr float steps = std::numeric_limits<std::uint8_t>::max();
  const float step = greatest > least ? (greatest - least) / steps : 1;
  std::array<std::vector<std::uint16_t>, 3> places;
  std::vector<std::uint8_t> log_odds;
  std::vector<std::uint32_t> surfaces;
  for (const PageVoxel& voxel : voxels) {
    places[0].push_back(static_cast<std::uint16_t>(voxel.x - low.x));  // an octree is 65536 voxels wide
    places[1].push_back(static_cast<std::uint16_t>(voxel.y - low.y));
    places[2].push_back(static_cast<std::uint16_t>(voxel.z - low.z));
    log_odds.push_back(static_cast<std::uint8_t>(std::lround((voxel.log_odds - least) / step)));
    surfaces.push_back(number_of(voxel.surface, snapshot));
  }
  block.json["voxels"] = {{"size", size},
                          {"low", Json::array({low.x, low.y, low.z})},
                          {"least_log_odds", least},
                          {"log_odds_step", step}};
  block.add("voxel_x", differences(places[0]));
  block.add("voxel_y", differences(places[1]));
  block.add("voxel_z", differences(places[2]));
  block.add("voxel_log_odds", log_odds);
  block.add("voxel_surface", surfaces);
}

}  // namespace

std::vector<PageVoxel> occupied_voxels(const OccupancyView& octree) {
  std::vector<PageVoxel> voxels;
  if (octree.resolution() == 0) return voxels;
  const double d = octree.resolution();
  constexpr double far = std::numeric_limits<double>::max();
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-far), Eigen::Vector3d::Constant(far));
  octree.for_each_occupied(everywhere, [&](const OccupancyView::Voxel& voxel) {
    const Eigen::Vector3d& at = voxel.center;
    voxels.push_back(
        {cell_of(at.x(), d), cell_of(at.y(), d), cell_of(at.z(), d), voxel.log_odds, voxel.surface});
    return true;
  });
  std::sort(voxels.begin(), voxels.end(),
            [](const PageVoxel& a, const PageVoxel& b) { return place_of(a) < place_of(b); });
  return voxels;
}

VoxelsMessage voxels_message(const PageMap& map, const std::vector<PageVoxel>& voxels, int merged) {
  PageBlock block;
  block.json["kind"] = "voxels";
  block.json["revision"] = map.snapshot->revision;
  block.json["merged"] = merged;
  block.json["voxels_before_merging"] = voxels.size();
  Json ids = Json::array();  // ids by number, as used in voxel_surface
  for (const SurfacePtr& surface : map.snapshot->surfaces) ids.push_back(surface->id);
  block.json["surface_ids"] = std::move(ids);
  const std::vector<PageVoxel> larger = merged > 1 ? merge_voxels(voxels, merged) : std::vector<PageVoxel>();
  const std::vector<PageVoxel>& drawn = merged == 1 ? voxels : larger;
  add_voxels(block, drawn, map.octree.resolution() * merged, *map.snapshot);
  return {block.packed(), drawn.size()};
}

}  // namespace octosurf::io
