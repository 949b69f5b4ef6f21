#include "detection/detection.hpp"

#include "detection/plane_extraction.hpp"
#include "detection/region_growing.hpp"
#include "detection/seen_through.hpp"

#include <algorithm>
#include <optional>

namespace octosurf::detection {
namespace {

using Index = occupancy::PointWindow::Index;

/// Paper III-C1: fewer than two neighbours within r can have no normal; they wait.
bool isolated(const surfaces::MapView& map, Index i, int reach, float radius) {
  const geometry::VoxelKey key = map.window[i].key;
  const Eigen::Vector3f p = map.window[i].position;
  const auto enough_within = [&](int box) {
    int neighbours = -1;  // itself
    map.window.for_each_row_near(key, box, [&](Index first, unsigned count) {
      if (neighbours >= 2) return;
      for (Index j = first; j < first + count; ++j)
        neighbours += map.window.columns().surface[j] == 0 &&
                      (map.window[j].position - p).squaredNorm() <= radius * radius;
    });
    return neighbours >= 2;
  };
  // Nearly every point has them next to it; then the blocks around need not be read.
  return !enough_within(std::min(1, reach)) && !enough_within(reach);
}

/// The proposal becomes a surface that has its points.
SurfaceId commit(surfaces::Ledger& ledger, const PlaneProposal& proposal) {
  const Eigen::Vector3d origin = ledger.window[proposal.points.front()].position.cast<double>();
  surfaces::SurfaceModel& surface = ledger.create(proposal.plane, origin);
  for (const Index i : proposal.points) ledger.give(i, surface);
  ledger.changes.born.insert(surface.id());
  return surface.id();
}

/// Smooth regions of pending points that no surface hides.
RegionGrowing::Regions regions_around(const surfaces::MapView& map, std::span<const Index> seeds) {
  RegionGrowing grow(map, map.parameters);
  SeenThrough seen_through(map);
  RegionGrowing::Regions regions = grow(seeds, [&](Index i) { return seen_through(i) == 0; });
  // Kept in key order from here on: RANSAC's draw must not depend on how the region was walked.
  for (std::vector<Index>& region : regions.large)
    std::sort(region.begin(), region.end(),
              [&](Index a, Index b) { return map.window[a].key < map.window[b].key; });
  return regions;
}

/// The region's planes one after the other, because each is judged beside the surfaces made before it.
void detect_in(surfaces::Ledger& ledger, const std::vector<Index>& region, Detection& result) {
  PlaneExtraction planes(ledger, region);
  while (std::optional<PlaneProposal> proposal = planes.next())
    if (proposal->refusal)
      result.refused.push_back({*proposal->refusal, std::move(proposal->points)});
    else
      result.born.push_back(commit(ledger, *proposal));
}

}  // namespace

std::optional<Detection> detect(surfaces::Ledger& ledger, std::span<const geometry::VoxelKey> accumulated) {
  std::vector<Index> waiting;
  for (const geometry::VoxelKey key : accumulated) {
    const Index i = ledger.window.find(key);
    if (i != occupancy::PointWindow::none && ledger.window[i].surface == 0) waiting.push_back(i);
  }
  if (waiting.size() < static_cast<std::size_t>(ledger.parameters.min_surface_points())) return {};
  return detect_from(ledger, std::move(waiting));
}

Detection detect_from(surfaces::Ledger& ledger, std::vector<Index> waiting) {
  const Parameters& parameters = ledger.parameters;
  const double r = parameters.search_radius();
  const int reach = static_cast<int>(r / parameters.occupancy.resolution) + 1;
  std::vector<Index> alone;
  std::erase_if(waiting, [&](Index i) {
    if (!isolated(ledger, i, reach, static_cast<float>(r))) return false;
    alone.push_back(i);
    return true;
  });

  Detection result;
  result.refused.push_back({{Reason::isolated}, std::move(alone)});
  RegionGrowing::Regions regions = regions_around(ledger, waiting);
  for (std::vector<Index>& small : regions.small) {
    const surfaces::Refusal why = surfaces::fewer_than_n(
        surfaces::few::in_region, small.size(), static_cast<std::size_t>(parameters.min_surface_points()));
    result.refused.push_back({why, std::move(small)});
  }
  for (std::vector<Index>& region : regions.large) {
    detect_in(ledger, region, result);
    result.left_over.regions.push_back(std::move(region));
  }
  result.left_over.points = std::move(waiting);
  return result;
}

Detection::LeftOver left_over_of(const surfaces::MapView& map, std::vector<Index> points,
                                 std::span<const Index> seeds) {
  return {.regions = regions_around(map, seeds).large, .points = std::move(points)};
}

}  // namespace octosurf::detection
