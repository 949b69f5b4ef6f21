#include "detection/neighbourhood.hpp"

#include "detection/labelling.hpp"
#include "detection/seed_patches.hpp"
#include "detection/sure_plane.hpp"
#include "detection/voxel_blocks.hpp"
#include "detection/voxel_marks.hpp"

#include <array>
#include <cmath>
#include <map>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;
using surfaces::SurfaceModel;

/// A surface's voxels among the readings.
struct Among {
  /// How readings were seen, context or not.
  struct Views {
    double readings = 0, cos_incidence = 0, hits = 0;
    void add(const Reading& reading, const Plane& plane) {
      ++readings;
      cos_incidence += reading.cos_incidence(plane);
      hits += reading.hits;
    }
  };
  const SurfaceModel* surface;
  ClassMoments labelled{};  // of those that are to be labelled
  Views all{};
  std::array<Views, sensing::NoiseModel::classes> classes{};

  /// Of the surface's other inliers: seen and hit as those of their class here.
  Patch outside(const Readings& readings) const {
    ClassCosines cosines;
    for (std::size_t c = 0; c < classes.size(); ++c) {
      const Views& own = classes[c].readings > 0 ? classes[c] : all;
      cosines[c] = own.cos_incidence / own.readings;
    }
    Patch sums = patch_of(*surface, readings.model(), labelled, cosines, readings.cells_a_voxel());
    sums.hits *= all.hits / all.readings;
    return sums;
  }
};

/// Collects points, each in one list.
class Collector {
 public:
  explicit Collector(const surfaces::MapView& voxels)
      : map_(voxels.cells.map()),
        blocks_(seed_patch_edge(map_.grid.resolution())),
        gap_(static_cast<int>(std::ceil(map_.parameters.max_hole_size() / map_.grid.resolution() - 1e-9))) {}

  void add_point(PointId i) {
    if (taken_.insert(i)) around_.points.push_back(i);
  }
  void add_surface(const SurfaceModel& surface) {
    surface.for_each_inlier([&](const surfaces::Inlier& inlier) { add_point(map_.find(inlier.key)); });
  }

  /// Adds pending points within h as candidates; neighbours become context.
  Neighbourhood with_surroundings() && {
    const std::vector<PointId> inside = around_.points;
    VoxelMarks within_gap;
    for (const auto& [place, box] : blocks_.boxes(map_.window, inside, gap_)) within_gap.add(box);
    within_gap.for_each_point(map_.window, [&](PointId i) {
      if (map_.window[i].surface == 0) add(i);
    });
    add_neighbours_of(inside);
    add_neighbours_of(std::vector(around_.may_join));
    for (const PointId i : inside) add_along_ray(i);
    return std::move(around_);
  }

 private:
  void add_neighbours_of(const std::vector<PointId>& points) {
    for (const PointId point : points)
      for (const PointId i : map_.neighbours.of(point)) add(i);
  }

  /// Rays through a plane speak against it, whether the ray or the plane is new (Crossings).
  void add_along_ray(PointId point) {
    const occupancy::VoxelPoint& end = map_.window[point];
    const auto step = static_cast<float>(map_.grid.resolution());
    const int steps = static_cast<int>(sensing::ReadingModel::clutter_depth / 2 / map_.grid.resolution());
    for (int k = -steps; k <= steps; ++k) {
      geometry::VoxelKey passed;
      if (!map_.grid.key_of(end.position + static_cast<float>(k) * step * end.view, passed)) continue;
      if (const PointId i = map_.window.find(passed); i != PointId::none) add(i);
    }
  }

  void add(PointId i) {
    if (taken_.insert(i)) (map_.window[i].surface == 0 ? around_.may_join : around_.context).push_back(i);
  }

  const surfaces::MapView& map_;  // of cells
  VoxelBlocks blocks_;
  int gap_;  // voxels
  occupancy::PointSet taken_;
  Neighbourhood around_;
};

}  // namespace

Neighbourhood neighbourhood_of(const surfaces::MapView& map, std::span<const PointId> points,
                               std::span<const SurfaceId> surfaces) {
  Collector collector(map);
  for (const PointId i : points) collector.add_point(i);
  for (const SurfaceId id : surfaces) collector.add_surface(*map.surfaces.find(id));
  return std::move(collector).with_surroundings();
}

Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                         std::span<const SurfaceId> forgotten) {
  Segmentation known;
  known.labels.assign(readings.size_with_context(), clutter);
  std::map<SurfaceId, Label> label_of{{0, clutter}};
  std::vector<Among> among(1);  // by label
  for (const SurfaceId id : forgotten) label_of[id] = clutter;
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const SurfaceId id = readings[i].surface;
    const auto [entry, fresh] = label_of.try_emplace(id, static_cast<Label>(among.size()));
    if (fresh) among.push_back({surfaces.find(id)});
    known.labels[i] = entry->second;
    if (entry->second == clutter) continue;
    Among& its = among[entry->second];
    its.all.add(readings[i], its.surface->plane());
    its.classes[readings[i].range_class].add(readings[i], its.surface->plane());
    if (readings.is_context(i)) continue;
    readings.for_each_voxel(i, [&](PointId, const occupancy::VoxelPoint& p) {
      if (p.surface == id)
        its.labelled[p.range_class].add(p.position.cast<double>() - its.surface->reference());
    });
  }
  known.patches.resize(among.size());
  for (const auto& [id, label] : label_of) {
    if (label == clutter) continue;
    const Among& its = among[label];
    known.patches[label].plane = its.surface->plane();
    if (const Patch sums = its.outside(readings); sums.readings > 0)
      known.outside.push_back({id, label, sums});
  }
  refit_patches(readings, Junctions(readings, known.labels, known.patches), known);
  return known;
}

}  // namespace octosurf::detection
