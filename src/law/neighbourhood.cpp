#include "law/neighbourhood.hpp"

#include "law/labelling.hpp"
#include "law/planelets.hpp"
#include "law/voxel_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace octosurf::law {
namespace {

using Index = Readings::Index;
using surfaces::SurfaceModel;

/// Of a surface's inliers of one class of distance: those among the readings.
struct Seen {
  geometry::Moments moments;  // of those that are not context, about the surface's reference, unweighted
  double count = 0, facing = 0;
};

/// A surface's readings, and what it has beside them.
class Surroundings {
 public:
  Surroundings(const Readings& readings, const SurfaceModel& surface)
      : readings_(readings), surface_(surface) {}

  void add(Index i) {
    const Reading& reading = readings_[i];
    const double facing = reading.facing(surface_.plane());
    Seen& seen = classes_[reading.range_class];
    if (!readings_.is_context(i)) {
      seen.moments.add(reading.position.cast<double>() - surface_.reference());
      ++inside_;
    }
    ++seen.count;
    seen.facing += facing;
    facing_ += facing;
    hits_ += reading.hits;
    ++count_;
  }

  Patch outside() const {
    Patch sums;
    sums.plane = surface_.plane();
    sums.origin = surface_.reference();
    sums.pose_variance = readings_.model().pose_variance();
    if (surface_.size() == inside_) return sums;
    for (unsigned c = 0; c < classes_.size(); ++c) add_class(c, sums);
    sums.readings = static_cast<double>(surface_.size() - inside_);
    sums.hits = sums.readings * hits_ / static_cast<double>(count_);
    return sums;
  }

 private:
  void add_class(unsigned c, Patch& sums) const {
    const Seen& seen = classes_[c];
    geometry::Moments left = surface_.moments_of_class(c);
    left.add(seen.moments, -1);
    if (left.count < 0.5) return;
    const double here = seen.count > 0 ? seen.facing / seen.count : facing_ / static_cast<double>(count_);
    const double facing = std::max(here, readings_.model().facing_of(c, scatter_of(left)));
    sums.moments.add(left, readings_.model().weight(c, facing));
    sums.log_peaks += left.count * readings_.model().log_peak(c, facing);
  }

  /// m², about the surface's plane. Those here may be a corner that was seen along the plane, where noise
  /// does not leave it; readings elsewhere that scatter by more were seen more head-on.
  double scatter_of(const geometry::Moments& moments) const {
    const Plane& plane = surface_.plane();
    const double off = plane.signed_distance(surface_.reference() + moments.mean());
    return plane.normal.dot(moments.covariance() * plane.normal) + off * off;
  }

  const Readings& readings_;
  const SurfaceModel& surface_;
  std::array<Seen, sensing::NoiseModel::classes> classes_;
  double facing_ = 0, hits_ = 0;
  std::size_t count_ = 0, inside_ = 0;
};

/// Effort: the share of a surface's inliers among what is looked at, from which on all are looked at: at most
/// four times as many, and what shares their blocks. Only of a whole surface can be told whether it bends and
/// how much clutter is around it.
constexpr double share_for_whole = 0.25;

void add_blocks_of(const SurfaceModel& surface, const VoxelBlocks& blocks,
                   std::vector<VoxelBlocks::Place>& places) {
  surface.for_each_inlier([&](const surfaces::Inlier& inlier) { places.push_back(blocks.of(inlier.key)); });
}

/// With all blocks of the surfaces of which share_for_whole lies in these.
std::vector<VoxelBlocks::Place> with_whole_surfaces(const surfaces::MapView& map, const VoxelBlocks& blocks,
                                                    std::vector<VoxelBlocks::Place> places) {
  std::map<SurfaceId, std::size_t> inliers;
  for (const VoxelBlocks::Place place : places)
    blocks.for_each_point(map.window, place, [&](Index i) {
      if (map.window[i].surface != 0) ++inliers[map.window[i].surface];
    });
  for (const auto& [id, count] : inliers)
    if (const SurfaceModel& surface = *map.surfaces.find(id);
        static_cast<double>(count) >= share_for_whole * static_cast<double>(surface.size()))
      add_blocks_of(surface, blocks, places);
  return blocks.widened(std::move(places), 0);
}

}  // namespace

Neighbourhood neighbourhood_of(const surfaces::MapView& map, std::span<const geometry::VoxelKey> changed,
                               std::span<const SurfaceId> surfaces) {
  const double resolution = map.grid.resolution();
  const VoxelBlocks blocks(planelet_edge(resolution));
  std::vector<VoxelBlocks::Place> places;
  for (const geometry::VoxelKey key : changed) places.push_back(blocks.of(key));
  for (const SurfaceId id : surfaces) add_blocks_of(*map.surfaces.find(id), blocks, places);
  places = with_whole_surfaces(map, blocks, blocks.widened(std::move(places), 0));
  Neighbourhood around;
  for (const VoxelBlocks::Place place : blocks.widened(
           places, static_cast<int>(std::ceil(map.parameters.max_hole_size() / resolution - 1e-9)))) {
    const bool inside = std::binary_search(places.begin(), places.end(), place);
    blocks.for_each_point(map.window, place, [&](Index i) {
      const bool pending = map.window[i].surface == 0;
      (inside ? around.voxels : pending ? around.followers : around.context).push_back(map.window[i].key);
    });
  }
  return around;
}

Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                         std::span<const SurfaceId> forgotten) {
  Segmentation known;
  known.labels.assign(readings.size_with_context(), clutter);
  std::map<SurfaceId, Label> label_of;
  std::vector<Surroundings> around;  // of label - 1
  for (const SurfaceId id : forgotten) label_of[id] = clutter;
  label_of[0] = clutter;
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const auto [entry, fresh] =
        label_of.try_emplace(readings[i].surface, static_cast<Label>(around.size() + 1));
    if (fresh) around.emplace_back(readings, *surfaces.find(readings[i].surface));
    known.labels[i] = entry->second;
    if (entry->second != clutter) around[entry->second - 1].add(i);
  }
  known.patches.resize(around.size() + 1);
  for (const auto& [id, label] : label_of) {
    if (label == clutter) continue;
    known.patches[label].plane = surfaces.find(id)->plane();
    if (const Patch sums = around[label - 1].outside(); sums.readings > 0)
      known.outside.push_back({id, label, sums});
  }
  refit_patches(readings, Junctions(readings, known.labels, known.patches), known);
  return known;
}

}  // namespace octosurf::law
