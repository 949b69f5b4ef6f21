#include "detection/detection.hpp"

#include "detection/plane_extraction.hpp"
#include "detection/region_growing.hpp"

#include <algorithm>
#include <cmath>
#include <tsl/robin_map.h>

namespace octosurf {
namespace {

using Index = PointWindow::Index;

/// Paper III-C1: fewer than two neighbours within r can have no normal; they wait.
bool isolated(Workspace& work, Index i, int reach, float radius) {
  const VoxelKey key = work.window[i].key;
  const Eigen::Vector3f p = work.window[i].position;
  const auto enough_within = [&](int box) {
    int neighbours = -1;  // itself
    work.window.for_each_row_near(key, box, [&](Index first, unsigned count) {
      if (neighbours >= 2) return;
      for (Index j = first; j < first + count; ++j)
        neighbours += work.window.columns().surface[j] == 0 &&
                      (work.window[j].position - p).squaredNorm() <= radius * radius;
    });
    return neighbours >= 2;
  };
  // Nearly every point has them next to it, and then the blocks around are not asked for.
  return !enough_within(std::min(1, reach)) && !enough_within(reach);
}

/// Which points are seen through a surface; asked once of each, while no surface changes.
class SeenThrough {
 public:
  explicit SeenThrough(Workspace& work) : work_(work) {}

  /// The surface just in front of the point that the line of sight to it passes through; 0: none.
  SurfaceId operator()(Index i) {
    if (i >= answers_.size()) answers_.resize(std::max<std::size_t>(work_.window.size(), i + 1), unasked);
    if (answers_[i] == unasked) answers_[i] = in_front_of(work_.window[i]);
    return answers_[i];
  }

 private:
  static constexpr SurfaceId unasked = ~SurfaceId{0};
  using Surfaces = std::vector<const SurfaceModel*>;

  /// In the block of the point and those around it: within eight voxels.
  const Surfaces& near(VoxelKey key) {
    const auto [entry, fresh] = near_.try_emplace(key.packed() & blocks);
    Surfaces& surfaces = entry.value();
    if (fresh)
      for (const SurfaceId id : work_.state.surfaces.near(key, 8))
        surfaces.push_back(work_.state.surfaces.find(id));
    return surfaces;
  }

  SurfaceId in_front_of(const VoxelPoint& p) {
    constexpr double farthest = 0.3;  // m; deeper than any noise this could be
    const double depth = std::min(farthest, 2.5 * work_.state.noise.tolerance(p.range_class));
    for (const SurfaceModel* surface : near(p.key)) {
      const double behind = -surface->distance(p.position);
      if (behind <= 0 || behind > depth) continue;
      const auto facing = static_cast<float>(surface->plane().normal.dot(p.view.cast<double>()));
      if (facing < 0.2F) continue;
      const Eigen::Vector3f crossing = p.position + p.view * (static_cast<float>(behind) / facing);
      const PlaneCell cell = surface->cell_of(crossing);
      // Inside its border, where three of nine would be missing, so that what is seen past an edge is
      // not taken for noise.
      int around = 0;
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u) around += surface->covers({cell.u + u, cell.v + v});
      if (around >= 7) return surface->id();
    }
    return 0;
  }

  static constexpr std::uint64_t blocks = 0xfff8fff8fff8ULL;  // of eight voxels along each axis
  Workspace& work_;
  std::vector<SurfaceId> answers_;
  tsl::robin_map<std::uint64_t, Surfaces, PackedKeyHash> near_;
};

}  // namespace

std::vector<SurfaceId> detect(Workspace& work) {
  MapState& state = work.state;
  const Parameters& parameters = state.parameters;
  std::vector<Index> waiting;
  for (const VoxelKey key : state.accumulated) {
    const Index i = work.window.find(key);
    if (i != PointWindow::none && work.window[i].surface == 0) waiting.push_back(i);
  }
  if (waiting.size() < static_cast<std::size_t>(parameters.min_surface_points())) return {};

  state.accumulated.clear();
  return detect_from(work, std::move(waiting));
}

std::vector<SurfaceId> detect_from(Workspace& work, std::vector<Index> waiting, const RefusalSink* refusals) {
  const Parameters& parameters = work.state.parameters;
  const auto tell = [&](Reason why, Index i, SurfaceId surface) {
    if (refusals != nullptr) (*refusals)({{.reason = why, .surface = surface}, {&i, 1}});
  };
  const double r = parameters.search_radius();
  const int reach = static_cast<int>(r / parameters.occupancy.resolution) + 1;
  std::erase_if(waiting, [&](Index i) {
    if (!isolated(work, i, reach, static_cast<float>(r))) return false;
    tell(Reason::isolated, i, 0);
    return true;
  });

  RegionGrowing grow(work, parameters, refusals);
  PlaneExtraction extract(work, parameters, refusals);
  std::vector<SurfaceId> born;
  SeenThrough seen_through(work);
  const auto allowed = [&](Index i) {
    const SurfaceId in_front = parameters.aligned() ? seen_through(i) : 0;
    if (in_front != 0) tell(Reason::seen_through, i, in_front);
    return in_front == 0;
  };
  if (refusals != nullptr)
    for (const Index i : waiting) allowed(i);  // told of all: what is no seed is not asked again
  for (std::vector<Index>& region : grow(waiting, allowed)) {
    // Kept in key order from here on: RANSAC's draw must not depend on how the region was walked.
    std::sort(region.begin(), region.end(),
              [&](Index a, Index b) { return work.window[a].key < work.window[b].key; });
    const std::vector<SurfaceId> ids = extract(region);
    born.insert(born.end(), ids.begin(), ids.end());
    work.left_over.regions.push_back(std::move(region));
  }
  work.left_over.points = std::move(waiting);
  return born;
}

}  // namespace octosurf
