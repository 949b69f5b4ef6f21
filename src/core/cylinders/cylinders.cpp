#include "cylinders/cylinders.hpp"

#include "cylinders/cylinder_extraction.hpp"
#include "cylinders/cylinder_rules.hpp"
#include "geometry/breadth_first.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::cylinders {
namespace {

constexpr int adjacent_voxels = 2;            // a neighbour, or one voxel left out
constexpr std::size_t refined_points = 2000;  // sample size of a fit as good as one to all

class CylinderUpdate {
 public:
  CylinderUpdate(surfaces::Ledger& ledger, std::vector<PointId> points, Patches curved)
      : map_(ledger),
        cylinders_(ledger.cylinder_store()),
        points_(std::move(points)),
        curved_(std::move(curved)),
        rules_(map_),
        extract_(map_, rules_) {}

  void operator()() {
    grow_known();
    for (std::vector<PointId>& patch : curved_) {
      map_.window.put_in_order(patch);
      look_for_new(patch);
    }
    for (const std::vector<PointId>& cluster : connected_clusters()) look_for_new(cluster);
    refit_changed();
    merge_grown();
  }

 private:
  bool free(PointId i) const {
    return map_.window[i].surface == 0 && cylinders_.owner(map_.window[i].key) == 0;
  }
  surfaces::Inlier inlier(PointId i) const {
    const occupancy::VoxelPoint& p = map_.window[i];
    return {p.key, p.range_class, p.position};
  }
  Eigen::Vector3d position(PointId i) const { return map_.window[i].position.cast<double>(); }

  /// Grows from `frontier`, points of the cylinder.
  void flood(surfaces::CylinderModel& cylinder, std::vector<PointId> frontier) {
    geometry::breadth_first(frontier, [&](PointId from) {
      map_.window.for_each_near(map_.window[from].key, adjacent_voxels, [&](PointId i) {
        if (!free(i) || !rules_.fits(cylinder.shape, i)) return;
        cylinders_.add(cylinder, inlier(i));
        frontier.push_back(i);
      });
    });
  }

  void grow_known() {
    if (cylinders_.size() == 0 || points_.empty()) return;
    const double h = map_.parameters.max_hole_size();
    Eigen::AlignedBox3d around;
    for (const PointId i : points_) around.extend(position(i));
    for (const auto& entry : cylinders_) {
      surfaces::CylinderModel& cylinder = *cylinders_.find(entry.first);
      // Not published yet if this change created it.
      const CylinderPtr known = cylinder.published ? cylinder.published : cylinder.publish(0);
      const double half = known->length_m / 2 + h, radius = known->radius_m + h;
      const Eigen::Vector3d reach = half * known->axis.cwiseAbs() + Eigen::Vector3d::Constant(radius);
      if (!around.intersects({known->axis_point - reach, known->axis_point + reach})) continue;
      std::vector<PointId> taken;
      for (const PointId i : points_) {
        if (std::fabs(known->axis.dot(position(i) - known->axis_point)) > half || !free(i) ||
            !rules_.fits(cylinder.shape, i))
          continue;
        cylinders_.add(cylinder, inlier(i));
        taken.push_back(i);
      }
      flood(cylinder, std::move(taken));
    }
  }

  /// Connected points, curved patches among them; in key order.
  std::vector<std::vector<PointId>> connected_clusters() {
    // By cells of 4³ voxels: points of one, and of two that touch, are at most h apart.
    std::map<geometry::VoxelKey, std::vector<PointId>> cells;
    for (const PointId i : points_)
      if (free(i)) {
        const geometry::VoxelKey key = map_.window[i].key;
        cells[cell_of(key.x >> 2, key.y >> 2, key.z >> 2)].push_back(i);
      }
    std::vector<std::vector<PointId>> clusters;
    while (!cells.empty()) {
      std::vector<PointId> cluster;
      std::vector<geometry::VoxelKey> reached;
      const auto take = [&](std::map<geometry::VoxelKey, std::vector<PointId>>::iterator cell) {
        reached.push_back(cell->first);
        cluster.insert(cluster.end(), cell->second.begin(), cell->second.end());
        return cells.erase(cell);
      };
      take(cells.begin());
      geometry::breadth_first(reached, [&](geometry::VoxelKey at) {
        for (int z = at.z - 1; z <= at.z + 1; ++z)
          for (int y = at.y - 1; y <= at.y + 1; ++y)
            for (auto cell = cells.lower_bound(cell_of(at.x - 1, y, z));
                 cell != cells.end() && !(cell_of(at.x + 1, y, z) < cell->first);)
              cell = take(cell);
      });
      if (cluster.size() < rules_.min_points()) continue;
      map_.window.put_in_order(cluster);
      clusters.push_back(std::move(cluster));
    }
    return clusters;
  }
  static geometry::VoxelKey cell_of(int x, int y, int z) {
    const auto clamped = [](int k) { return static_cast<std::uint16_t>(std::clamp(k, 0, 65535)); };
    return {clamped(x), clamped(y), clamped(z)};
  }

  void look_for_new(std::vector<PointId> points) {
    std::erase_if(points, [&](PointId i) { return !free(i); });
    while (points.size() >= rules_.min_points()) {
      const auto found = extract_(points);
      if (!found) return;
      take(*found);
      // With its neighbourhood, so that no second cylinder is found beside it.
      std::erase_if(points, [&](PointId i) {
        return !free(i) || std::fabs(found->shape.distance(position(i))) <= 2 * rules_.tolerance(i);
      });
    }
  }

  /// Creates a new cylinder, or extends a known one in the same place.
  void take(const CylinderExtraction::ExtractedCylinder& found) {
    for (const auto& entry : cylinders_) {
      surfaces::CylinderModel& known = *cylinders_.find(entry.first);
      if (!same_place(known, found)) continue;
      const bool better = found.inliers.size() > known.inliers.size();
      if (better) known.shape = along(found.shape, known.shape.axis);
      for (const PointId i : found.inliers)
        if (better || rules_.fits(known.shape, i)) cylinders_.add(known, inlier(i));
      known.unchecked = known.inliers.size();
      return;
    }
    surfaces::CylinderModel& cylinder = cylinders_.create(found.shape);
    for (const PointId i : found.inliers) cylinders_.add(cylinder, inlier(i));
    flood(cylinder, found.inliers);
  }

  static geometry::CylinderShape along(geometry::CylinderShape shape, const Eigen::Vector3d& axis) {
    if (shape.axis.dot(axis) < 0) shape.axis = -shape.axis;
    return shape;
  }

  /// Whether the two would overlap.
  bool same_place(const surfaces::CylinderModel& known,
                  const CylinderExtraction::ExtractedCylinder& found) const {
    constexpr double cos_30_deg = 0.8660254037844386;
    if (std::fabs(known.shape.axis.dot(found.shape.axis)) < cos_30_deg) return false;
    std::size_t over = 0;
    const auto extent = geometry::extent_of(known.shape, known.samples(map_.noise));
    const double h = map_.parameters.max_hole_size();
    for (const PointId i : found.inliers) {
      const double height = known.shape.height(position(i));
      over += height >= extent.low - h && height <= extent.high + h &&
              known.shape.distance(position(i)) <= 2 * rules_.tolerance(i);
    }
    return 2 * over > found.inliers.size();
  }

  /// Refits the shape to the inliers; false if it is no longer convincing.
  bool fitted(surfaces::CylinderModel& cylinder) const {
    const Eigen::Vector3d axis = cylinder.shape.axis;
    const std::vector<geometry::CylinderSample> samples =
        cylinder.samples(map_.noise, CylinderRules::stride(cylinder.inliers.size(), refined_points));
    if (!geometry::refine(cylinder.shape, samples)) return false;
    cylinder.shape = along(cylinder.shape, axis);
    return rules_.convincing(cylinder.shape, samples, true);
  }

  /// Removes inliers 1.5 tolerances and more off the lateral surface.
  void drop_misfits(surfaces::CylinderModel& cylinder) {
    std::vector<geometry::VoxelKey> misfits;
    for (const auto& [key, point] : cylinder.inliers)
      if (std::fabs(cylinder.shape.distance(point.position.cast<double>())) >
          1.5 * map_.noise.tolerance(point.range_class))
        misfits.push_back(key);
    for (const geometry::VoxelKey key : misfits) cylinders_.release(key);
  }

  bool refit(surfaces::CylinderModel& cylinder) {
    if (!fitted(cylinder)) return false;
    drop_misfits(cylinder);
    cylinder.unchecked = 0;
    return cylinder.inliers.size() >= rules_.min_points();
  }

  void refit_changed() {
    const std::set<CylinderId> touched = cylinders_.touched();
    for (const CylinderId id : touched) {
      surfaces::CylinderModel& cylinder = *cylinders_.find(id);
      const bool changed = cylinder.unchecked * 8 > cylinder.inliers.size();
      if (cylinder.inliers.size() < rules_.min_points() || (changed && !refit(cylinder)))
        cylinders_.erase(id);
    }
  }

  /// Whether one cylinder explains both.
  bool joined(const surfaces::CylinderModel& a, const surfaces::CylinderModel& b) const {
    constexpr double cos_10_deg = 0.984807753012208;
    const sensing::NoiseModel& noise = map_.noise;
    const double slack = noise.tolerance(1);
    if (std::fabs(a.shape.axis.dot(b.shape.axis)) < cos_10_deg ||
        std::fabs(a.shape.radius - b.shape.radius) > slack)
      return false;
    // Quick test before every point is compared.
    const double sin_10_deg = 0.17364817766693033;
    if (a.shape.from_axis(b.shape.point).norm() >
        slack + sin_10_deg * std::fabs(a.shape.height(b.shape.point)))
      return false;
    const auto of_a = a.samples(noise), of_b = b.samples(noise);
    const geometry::CylinderExtent extent_a = geometry::extent_of(a.shape, of_a),
                                   extent_b = geometry::extent_of(a.shape, of_b);
    const double gap = std::max(extent_a.low, extent_b.low) - std::min(extent_a.high, extent_b.high);
    if (gap > map_.parameters.max_hole_size()) return false;
    const auto off = [](const surfaces::CylinderModel& m,
                        const std::vector<geometry::CylinderSample>& points) {
      double squares = 0;
      for (const geometry::CylinderSample& s : points) squares += std::pow(m.shape.distance(s.position), 2);
      return std::sqrt(squares / static_cast<double>(points.size()));
    };
    return off(a, of_b) <= off(b, of_b) + slack / 2 && off(b, of_a) <= off(a, of_a) + slack / 2;
  }

  void merge_grown() {
    const std::set<CylinderId> touched = cylinders_.touched();
    for (const CylinderId id : touched) {
      const surfaces::CylinderModel* one = cylinders_.find(id);
      if (one == nullptr) continue;
      for (const auto& entry : cylinders_) {
        if (entry.first == id || !joined(*one, entry.second)) continue;
        merge(id, entry.first);
        break;  // a third one waits until either changes again
      }
    }
  }
  void merge(CylinderId a, CylinderId b) {
    // The larger keeps its id, the older one on a tie.
    const auto size = [&](CylinderId id) { return cylinders_.find(id)->inliers.size(); };
    if (size(a) < size(b) || (size(a) == size(b) && b < a)) std::swap(a, b);
    surfaces::CylinderModel joint = *cylinders_.find(a);
    joint.inliers.insert(cylinders_.find(b)->inliers.begin(), cylinders_.find(b)->inliers.end());
    if (!fitted(joint)) return;
    const std::map<geometry::VoxelKey, surfaces::Inlier> inliers = cylinders_.find(b)->inliers;
    cylinders_.erase(b, a);
    surfaces::CylinderModel& into = *cylinders_.find(a);
    for (const auto& [key, point] : inliers) cylinders_.add(into, point);
    into.shape = joint.shape;
    drop_misfits(into);
    into.unchecked = 0;
  }

  const surfaces::MapView& map_;
  surfaces::CylinderStore& cylinders_;
  std::vector<PointId> points_;
  Patches curved_;
  CylinderRules rules_;
  CylinderExtraction extract_;
};

}  // namespace

void retract_cylinders(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta) {
  surfaces::CylinderStore& cylinders = ledger.cylinder_store();
  if (cylinders.size() == 0) return;
  for (const occupancy::VoxelPoint& p : delta.vanished) cylinders.release(p.key);
  for (const occupancy::OccupancyDelta::Refined& r : delta.refined) {
    const CylinderId id = cylinders.owner(r.after.key);
    if (id == 0) continue;
    const double misfit = cylinders.find(id)->shape.distance(r.after.position.cast<double>());
    if (std::fabs(misfit) <= 1.5 * ledger.noise.tolerance(r.after.range_class))
      cylinders.move({r.after.key, r.after.range_class, r.after.position});
    else
      cylinders.release(r.after.key);
  }
}

void update_cylinders(surfaces::Ledger& ledger, std::vector<PointId> points, Patches curved) {
  if (!ledger.parameters.detection.detect_cylinders) return;
  if (points.empty() && curved.empty() && ledger.cylinder_store().touched().empty()) return;
  CylinderUpdate{ledger, std::move(points), std::move(curved)}();
}

}  // namespace octosurf::cylinders
