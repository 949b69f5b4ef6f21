#include "detection/expand.hpp"

#include "detection/constants.hpp"
#include "detection/neighbour_labels.hpp"
#include "detection/patch_graph.hpp"
#include "detection/planelets.hpp"
#include "detection/sure_plane.hpp"
#include "geometry/disjoint_sets.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tsl/robin_map.h>

namespace octosurf::detection {
namespace {

/// Surfaces' planes with covariance, each computed once.
class SurePlanes {
 public:
  explicit SurePlanes(const surfaces::MapView& map) : map_(map), model_(map.noise, map.grid.resolution()) {}

  const sensing::ReadingModel& model() const { return model_; }
  Patch patch(SurfaceId id) const { return patch_of(*map_.surfaces.find(id), model_); }
  double log_ratio(SurfaceId id, PointId i) {
    auto at = planes_.find(id);
    if (at == planes_.end()) at = planes_.emplace(id, SurePlane(patch(id), model_)).first;
    return at->second.log_ratio(map_.window[i]);
  }

 private:
  const surfaces::MapView& map_;
  sensing::ReadingModel model_;
  tsl::robin_map<SurfaceId, SurePlane> planes_;
};

/// Expansion of surfaces over pending points.
class Flood {
 public:
  explicit Flood(const surfaces::MapView& map)
      : map_(map),
        planes_(map),
        reach_(occupancy::Neighbours::voxels(map.parameters.max_hole_size(), map.grid.resolution())) {}

  void run(std::vector<PointId> frontier) {
    while (!frontier.empty()) {
      std::vector<Assignment> round;
      for (const PointId i : frontier)
        if (const SurfaceId id = best_surface(i); id != 0) round.push_back({i, id});
      for (const auto& [i, id] : round) gained_.emplace(i, id);
      frontier = pending_around(round);
    }
  }

  /// In key order, so that sums are rounded the same; without pieces that are not one plane with their
  /// surface.
  std::vector<Assignment> accepted() {
    std::vector<Assignment> all;
    for (const auto& [i, id] : gained_) all.push_back({i, id});
    const auto key = [this](const Assignment& a) { return map_.window[a.point].key; };
    std::sort(all.begin(), all.end(),
              [&](const Assignment& a, const Assignment& b) { return key(a) < key(b); });
    std::map<std::size_t, std::vector<PointId>> pieces;  // by root
    geometry::DisjointSets sets = connected(all);
    for (std::size_t k = 0; k < all.size(); ++k) pieces[sets.root(k)].push_back(all[k].point);
    std::set<std::size_t> refused;
    for (const auto& [root, points] : pieces)
      if (!merges(all[root].surface, points)) refused.insert(root);
    std::vector<Assignment> kept;
    for (std::size_t k = 0; k < all.size(); ++k)
      if (!refused.contains(sets.root(k))) kept.push_back(all[k]);
    return kept;
  }

 private:
  SurfaceId owner(PointId i) const {
    const auto gained = gained_.find(i);
    return gained == gained_.end() ? map_.window[i].surface : gained->second;
  }

  SurfaceId best_surface(PointId i) {
    NeighbourLabels near;
    map_.neighbours.for_each_within(i, reach_, [&](PointId j) {
      const SurfaceId id = owner(j);
      near.add(id != 0 && is_separated(i, j, id) ? clutter : id);
    });
    return near.best([&](SurfaceId id) { return planes_.log_ratio(id, i); });
  }

  /// A surface at an angle to that of `j` explains `j`, too, or passes between the two and has inliers there.
  bool is_separated(PointId i, PointId j, SurfaceId id) {
    const std::vector<SurfaceId>& ids = ids_near(j);
    if (ids.size() < 2) return false;
    const Plane& plane = map_.surfaces.find(id)->plane();
    const Eigen::Vector3f a = map_.window[i].position, b = map_.window[j].position;
    return std::any_of(ids.begin(), ids.end(), [&](SurfaceId other) {
      const surfaces::SurfaceModel& wall = *map_.surfaces.find(other);
      if (std::fabs(plane.normal.dot(wall.plane().normal)) >= Constants::cos_nearly_parallel) return false;
      const double from = wall.distance(a), to = wall.distance(b);
      const Eigen::Vector3f at =
          from * to < 0 ? Eigen::Vector3f(a + static_cast<float>(from / (from - to)) * (b - a)) : b;
      return wall.nearest(wall.cell_of(at), 1).has_value() &&
             (from * to < 0 || planes_.log_ratio(other, j) > 0);
    });
  }

  const std::vector<SurfaceId>& ids_near(PointId i) {
    const auto [at, fresh] = ids_near_.try_emplace(i);
    if (fresh) {
      const surfaces::SurfaceStore::Ids ids = map_.surfaces.near(map_.window[i].key, 1);
      at.value().assign(ids.begin(), ids.end());
    }
    return at->second;
  }

  std::vector<PointId> pending_around(const std::vector<Assignment>& round) const {
    std::vector<PointId> around;
    for (const Assignment& assignment : round)
      map_.neighbours.for_each_within(assignment.point, reach_, [&](PointId j) {
        if (owner(j) == 0) around.push_back(j);
      });
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return around;
  }

  /// Neighbours assigned to the same surface.
  geometry::DisjointSets connected(const std::vector<Assignment>& gained) const {
    geometry::DisjointSets sets(gained.size());
    tsl::robin_map<PointId, std::size_t> place;
    for (std::size_t k = 0; k < gained.size(); ++k) place.emplace(gained[k].point, k);
    for (std::size_t k = 0; k < gained.size(); ++k)
      map_.neighbours.for_each_within(gained[k].point, reach_, [&](PointId j) {
        if (const auto at = place.find(j);
            at != place.end() && gained[at->second].surface == gained[k].surface)
          sets.join(k, at->second);
      });
    return sets;
  }

  bool merges(SurfaceId id, const std::vector<PointId>& points) const {
    if (points.size() < Constants::fewest_of_plane) return true;  // too few to contradict it
    const Patch surface = planes_.patch(id);
    Patch gain;
    gain.origin = map_.window[points.front()].position.cast<double>();
    gain.plane = surface.plane;
    gain.pose_variance = surface.pose_variance;
    gain.readings = gain.hits = static_cast<double>(points.size());
    double pairs = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const PointId i : points) {
      const occupancy::VoxelPoint& p = map_.window[i];
      const double facing = surface.plane.normal.dot(p.view.cast<double>());
      gain.moments.add(p.position.cast<double>() - gain.origin,
                       planes_.model().weight(p.range_class, facing));
      gain.log_peaks += planes_.model().log_peak(p.range_class, facing);
      map_.window.for_each_near(p.key, 1, [&](PointId j) {
        if (map_.window[j].surface != id) return;
        ++pairs;
        sum += p.position.cast<double>();
      });
    }
    gain.fit();
    const Eigen::Vector3d at = pairs > 0 ? Eigen::Vector3d(sum / pairs) : gain.centroid();
    return log_same(surface, gain, at) > 0;
  }

  const surfaces::MapView& map_;
  SurePlanes planes_;
  int reach_;  // voxels
  tsl::robin_map<PointId, SurfaceId> gained_;
  tsl::robin_map<PointId, std::vector<SurfaceId>> ids_near_;
};

}  // namespace

std::vector<Assignment> add_inliers(const surfaces::MapView& map, std::span<const PointId> fresh) {
  SurePlanes planes(map);
  std::vector<Assignment> added;
  for (const PointId i : fresh) {
    Assignment best{i, 0};
    double most = 0;
    for (const SurfaceId id : map.surfaces.near(map.window[i].key, 1)) {
      const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
      if (!surface.covers(surface.cell_of(map.window[i].position))) continue;
      const double log_ratio = planes.log_ratio(id, i);
      if (!(log_ratio > most)) continue;
      most = log_ratio;
      best.surface = id;
    }
    if (best.surface != 0) added.push_back(best);
  }
  return added;
}

std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> left) {
  Flood flood(map);
  flood.run({left.begin(), left.end()});
  return flood.accepted();
}

std::vector<PointId> touching(const surfaces::MapView& map, std::span<const Assignment> assignments) {
  SurePlanes planes(map);
  const int gap = static_cast<int>(map.parameters.max_hole_size() / map.grid.resolution());
  std::map<std::pair<SurfaceId, SurfaceId>, bool> alike;
  std::vector<PointId> points;
  for (const auto& [point, surface] : assignments) {
    const occupancy::VoxelPoint& p = map.window[point];
    const auto may_be_one = [&, own = surface](SurfaceId other) {
      if (other == own || !(planes.log_ratio(other, point) > 0)) return false;
      const auto [at, fresh] = alike.try_emplace(std::minmax(own, other), false);
      if (fresh) at->second = log_same(planes.patch(own), planes.patch(other), p.position.cast<double>()) > 0;
      return at->second;
    };
    const surfaces::SurfaceStore::Ids ids = map.surfaces.near(p.key, gap);
    if (std::any_of(ids.begin(), ids.end(), may_be_one)) points.push_back(point);
  }
  return points;
}

}  // namespace octosurf::detection
