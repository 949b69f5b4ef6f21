#include "detection/neighbourhood.hpp"

#include "detection/labelling.hpp"
#include "detection/seed_patches.hpp"
#include "detection/voxel_blocks.hpp"
#include "detection/voxel_marks.hpp"

#include <algorithm>
#include <cmath>
#include <tsl/robin_map.h>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;
using surfaces::SurfaceModel;

/// The sums of a surface's inliers that are not to be labelled.
class Surroundings {
 public:
  Surroundings(const Readings& readings, const SurfaceModel& surface, const SurfaceSeen& seen)
      : readings_(readings), surface_(surface), seen_(seen) {}

  void add(Index i) {
    if (readings_.is_context(i)) return;
    readings_.for_each_voxel(i, [&](PointId, const occupancy::VoxelPoint& p) {
      if (p.surface != surface_.id()) return;
      inside_[p.range_class].add(p.position.cast<double>() - surface_.reference());
      ++count_;
    });
  }

  Patch outside() const {
    Patch sums;
    sums.plane = surface_.plane();
    sums.origin = surface_.reference();
    sums.pose_variance = readings_.model().pose_variance();
    if (surface_.size() == count_) return sums;
    const double cells_a_voxel = seen_.all.count / seen_.voxels;
    for (unsigned c = 0; c < inside_.size(); ++c) add_class(c, cells_a_voxel, sums);
    sums.readings = static_cast<double>(surface_.size() - count_) * cells_a_voxel;
    sums.hits = sums.readings * seen_.hits / seen_.all.count;
    return sums;
  }

 private:
  void add_class(unsigned c, double cells_a_voxel, Patch& sums) const {
    geometry::Moments left = surface_.moments_of_class(c);
    left.add(inside_[c], -1);
    if (left.count < 0.5) return;
    const SurfaceSeen::Views& own = seen_.classes[c].count > 0 ? seen_.classes[c] : seen_.all;
    const sensing::ReadingModel& model = readings_.model();
    const double cosine =
        std::max(own.cos_incidence / own.count, model.cos_incidence_of(c, scatter_of(left)));
    sums.moments.add(left, cells_a_voxel * model.weight(c, cosine));
    sums.log_peaks += cells_a_voxel * left.count * model.log_peak(c, cosine);
  }

  /// m², about the surface's plane. The readings here may be a corner seen at a grazing angle, with less
  /// scatter; readings elsewhere that scatter more were seen more head-on.
  double scatter_of(const geometry::Moments& moments) const {
    const Plane& plane = surface_.plane();
    const double off = plane.signed_distance(surface_.reference() + moments.mean());
    return plane.normal.dot(moments.covariance() * plane.normal) + off * off;
  }

  const Readings& readings_;
  const SurfaceModel& surface_;
  const SurfaceSeen& seen_;
  std::array<geometry::Moments, sensing::NoiseModel::classes> inside_;  // about the reference, unweighted
  std::size_t count_ = 0;
};

/// Collects points, each in one list.
class Collector {
 public:
  explicit Collector(const surfaces::MapView& voxels)
      : map_(voxels.cells.map()),
        blocks_(seed_patch_edge(map_.grid.resolution())),
        gap_(static_cast<int>(std::ceil(map_.parameters.max_hole_size() / map_.grid.resolution() - 1e-9))),
        cubes_(std::max(1, gap_ / 4)) {}

  void add_point(PointId i) {
    if (taken_.insert(i)) around_.points.push_back(i);
  }
  void add_surface(const SurfaceModel& surface) {
    surface.for_each_inlier([&](const surfaces::Inlier& inlier) { add_point(map_.find(inlier.key)); });
  }

  /// Adds pending points within h as candidates; boundaries and neighbours become context.
  Neighbourhood with_surroundings() && {
    const std::vector<PointId> inside = around_.points;
    VoxelMarks within_gap;
    for (const auto& [place, box] : blocks_.boxes(map_.window, inside, gap_)) within_gap.add(box);
    const SurfaceModel* surface = nullptr;  // the last one: neighbouring points mostly have the same
    within_gap.for_each_point(map_.window, [&](PointId i) {
      const occupancy::VoxelPoint& point = map_.window[i];
      if (point.surface == 0) {
        if (taken_.insert(i)) around_.may_join.push_back(i);
        return;
      }
      if (surface == nullptr || surface->id() != point.surface) surface = map_.surfaces.find(point.surface);
      if (!surface->surrounded(surface->cell_of(point.position)) && is_first_of_its_cube(point) &&
          taken_.insert(i))
        around_.boundary.push_back(i);
    });
    add_neighbours_of(inside);
    add_neighbours_of(std::vector(around_.may_join));
    for (const PointId i : inside) add_along_ray(i);
    return std::move(around_);
  }

 private:
  /// Effort: one boundary reading in each cube of a quarter of h suffices to search across gaps.
  bool is_first_of_its_cube(const occupancy::VoxelPoint& point) {
    const auto [at, fresh] = boundary_.try_emplace(cubes_.of(point.key), point.surface);
    if (!fresh && at->second == point.surface) return false;
    at.value() = point.surface;
    return true;
  }

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
  VoxelBlocks cubes_;
  occupancy::PointSet taken_;
  tsl::robin_map<VoxelBlocks::Place, SurfaceId, geometry::PackedKeyHash>
      boundary_;  // surface of the last one taken, by cube
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

std::map<SurfaceId, SurfaceSeen> seen_among(const Readings& readings,
                                            const surfaces::SurfaceStore& surfaces) {
  std::map<SurfaceId, SurfaceSeen> all;
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const Reading& reading = readings[i];
    if (reading.surface == 0) continue;
    SurfaceSeen& seen = all[reading.surface];
    const double cos_incidence = reading.cos_incidence(surfaces.find(reading.surface)->plane());
    for (SurfaceSeen::Views* views : {&seen.all, &seen.classes[reading.range_class]}) {
      ++views->count;
      views->cos_incidence += cos_incidence;
    }
    seen.hits += reading.hits;
    readings.for_each_voxel(
        i, [&](PointId, const occupancy::VoxelPoint& p) { seen.voxels += p.surface == reading.surface; });
  }
  return all;
}

void SurfaceSeen::add(const SurfaceSeen& other) {
  const auto sum = [](Views& to, const Views& some) {
    to.count += some.count;
    to.cos_incidence += some.cos_incidence;
  };
  sum(all, other.all);
  for (std::size_t c = 0; c < classes.size(); ++c) sum(classes[c], other.classes[c]);
  voxels += other.voxels;
  hits += other.hits;
}

Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                         const std::map<SurfaceId, SurfaceSeen>& seen, std::span<const SurfaceId> forgotten) {
  Segmentation known;
  known.labels.assign(readings.size_with_context(), clutter);
  std::map<SurfaceId, Label> label_of;
  std::vector<Surroundings> around;  // of label - 1
  for (const SurfaceId id : forgotten) label_of[id] = clutter;
  label_of[0] = clutter;
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const SurfaceId id = readings[i].surface;
    const auto [entry, fresh] = label_of.try_emplace(id, static_cast<Label>(around.size() + 1));
    if (fresh) around.emplace_back(readings, *surfaces.find(id), seen.at(id));
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

}  // namespace octosurf::detection
