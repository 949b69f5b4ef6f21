#include "cylinders/cylinders.hpp"

#include "cylinders/cylinder_criterion.hpp"
#include "geometry/breadth_first.hpp"
#include "geometry/moments.hpp"
#include "geometry/symmetric.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

namespace octosurf::cylinders {
namespace {

constexpr std::size_t fewest_of_part = 12;  // points: twice a quadratic surface's parameters
constexpr std::size_t parts_of_bar = 4;     // effort: a part of a patch has this share of n, or more
constexpr int rounds = 3;                   // effort: a shape and its points, each from the other
constexpr std::size_t sampled = 100;        // effort: points of a first fit; four times as many decide

class CylinderUpdate {
 public:
  CylinderUpdate(surfaces::Ledger& ledger, std::span<const PointId> points)
      : map_(ledger), cylinders_(ledger.cylinder_store()), criterion_(map_), points_(points) {}

  void operator()(Patches& bent) {
    grow_known();
    for (std::vector<PointId>& patch : bent) {
      map_.window.put_in_order(patch);
      begin_in(std::move(patch));
    }
    refit_changed();
    merge_grown();
  }

 private:
  using Shape = geometry::CylinderShape;

  bool free(PointId i) const {
    return map_.window[i].surface == 0 && cylinders_.owner(map_.window[i].key) == 0;
  }
  surfaces::Inlier inlier(PointId i) const {
    const occupancy::VoxelPoint& p = map_.window[i];
    return {p.key, p.range_class, p.position};
  }
  Eigen::Vector3d position(PointId i) const { return map_.window[i].position.cast<double>(); }

  /// The free points that belong to a shape and are connected with some of `from`, through the octree.
  std::vector<PointId> connected(const Shape& shape, std::span<const PointId> from) const {
    std::vector<PointId> reached;
    occupancy::PointSet seen;
    const auto look_at = [&](PointId i) {
      if (seen.insert(i) && free(i) && criterion_.belongs(shape, map_.window[i])) reached.push_back(i);
    };
    for (const PointId i : from) look_at(i);
    geometry::breadth_first(reached, [&](PointId i) {
      for (const PointId j : map_.neighbours.of(i)) look_at(j);
    });
    return reached;
  }
  void take(surfaces::CylinderModel& cylinder, std::span<const PointId> points) {
    for (const PointId i : points) cylinders_.add(cylinder, inlier(i));
  }

  /// Known cylinders take the points that belong to them, and those connected with these.
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
      std::vector<PointId> beside;
      for (const PointId i : points_)
        if (std::fabs(known->axis.dot(position(i) - known->axis_point)) <= half) beside.push_back(i);
      take(cylinder, connected(cylinder.shape, beside));
    }
  }

  /// Finds cylinders in a patch: in all of it, then in each half of the rest, because a ladder's front
  /// is one patch of many bars.
  void begin_in(std::vector<PointId> patch) {
    const std::size_t fewest = std::max<std::size_t>(fewest_of_part, criterion_.min_points() / parts_of_bar);
    const auto leave_free = [&] { std::erase_if(patch, [&](PointId i) { return !free(i); }); };
    leave_free();
    if (patch.size() < fewest) return;
    if (begin_with(patch) < fewest) return;  // its halves have no other shape
    leave_free();
    if (patch.size() < 2 * fewest) return;
    geometry::Moments moments;
    const Eigen::Vector3d first = position(patch.front());
    for (const PointId i : patch) moments.add(position(i) - first);
    const Eigen::Vector3d middle = first + moments.mean(),
                          along = geometry::principal_axes(moments.covariance()).vectors.col(2);
    const auto half = std::stable_partition(patch.begin(), patch.end(),
                                            [&](PointId i) { return along.dot(position(i) - middle) < 0; });
    if (half == patch.begin() || half == patch.end()) return;
    begin_in({patch.begin(), half});
    begin_in({half, patch.end()});
  }

  /// Returns how many points of the patch are not of its shape.
  std::size_t begin_with(std::span<const PointId> patch) {
    std::optional<Shape> shape = criterion_.through(patch);
    if (!shape || !geometry::refine(*shape, criterion_.samples(patch, sampled))) return patch.size();
    std::size_t its = 0;
    for (const PointId i : patch) its += criterion_.belongs(*shape, map_.window[i]);
    const std::size_t others = patch.size() - its;
    if (4 * others > patch.size()) return others;  // of several bars: its halves are tried
    std::vector<PointId> inliers;
    for (int round = 0; round < rounds; ++round) {
      inliers = connected(*shape, patch);
      if (!geometry::refine(*shape, criterion_.samples(inliers, sampled)) || shape->radius > largest_radius)
        return others;
    }
    inliers = connected(*shape, patch);
    if (inliers.size() < criterion_.min_points() ||
        !criterion_.convincing(*shape, criterion_.samples(inliers, 4 * sampled), false))
      return others;
    // Up, or along +x or +y, independent of the patch.
    const Eigen::Vector3d& a = shape->axis;
    const double level = 1e-3;
    const double sign = std::fabs(a.z()) > level ? a.z() : std::fabs(a.x()) > level ? a.x() : a.y();
    if (sign < 0) shape->axis = -a;
    take(cylinders_.create(*shape), inliers);
    return others;
  }

  static Shape along(Shape shape, const Eigen::Vector3d& axis) {
    if (shape.axis.dot(axis) < 0) shape.axis = -shape.axis;
    return shape;
  }

  /// Refits the shape to the inliers; false if it is no longer convincing.
  bool fitted(surfaces::CylinderModel& cylinder) const {
    const Eigen::Vector3d axis = cylinder.shape.axis;
    const std::vector<geometry::CylinderSample> samples = criterion_.samples(cylinder);
    if (!geometry::refine(cylinder.shape, samples)) return false;
    cylinder.shape = along(cylinder.shape, axis);
    return criterion_.convincing(cylinder.shape, samples, true);
  }

  void drop_misfits(surfaces::CylinderModel& cylinder) {
    std::vector<geometry::VoxelKey> misfits;
    for (const auto& [key, point] : cylinder.inliers)
      if (std::fabs(cylinder.shape.distance(point.position.cast<double>())) >
          criterion_.reach(point.range_class))
        misfits.push_back(key);
    for (const geometry::VoxelKey key : misfits) cylinders_.release(key);
  }

  bool refit(surfaces::CylinderModel& cylinder) {
    if (!fitted(cylinder)) return false;
    drop_misfits(cylinder);
    cylinder.unchecked = 0;
    return cylinder.inliers.size() >= criterion_.min_points();
  }

  void refit_changed() {
    const std::set<CylinderId> touched = cylinders_.touched();
    for (const CylinderId id : touched) {
      surfaces::CylinderModel& cylinder = *cylinders_.find(id);
      const bool changed = cylinder.unchecked * 8 > cylinder.inliers.size();
      if (cylinder.inliers.size() < criterion_.min_points() || (changed && !refit(cylinder)))
        cylinders_.erase(id);
    }
  }

  /// One cylinder that explains both, if there is one.
  std::optional<surfaces::CylinderModel> joint_of(const surfaces::CylinderModel& a,
                                                  const surfaces::CylinderModel& b) const {
    constexpr double cos_30_deg = 0.8660254037844386;
    if (std::fabs(a.shape.axis.dot(b.shape.axis)) < cos_30_deg) return {};
    const double h = map_.parameters.max_hole_size();
    const auto of_a = criterion_.samples(a), of_b = criterion_.samples(b);
    const geometry::CylinderExtent extent_a = geometry::extent_of(a.shape, of_a),
                                   extent_b = geometry::extent_of(a.shape, of_b);
    if (std::max(extent_a.low, extent_b.low) - std::min(extent_a.high, extent_b.high) > h) return {};
    if (a.shape.from_axis(b.shape.point).norm() > a.shape.radius + b.shape.radius) return {};
    surfaces::CylinderModel joint = a;
    joint.inliers.insert(b.inliers.begin(), b.inliers.end());
    if (!fitted(joint)) return {};
    if (!criterion_.explains(joint.shape, of_a) || !criterion_.explains(joint.shape, of_b)) return {};
    return joint;
  }

  void merge_grown() {
    const std::set<CylinderId> touched = cylinders_.touched();
    for (const CylinderId id : touched) {
      const surfaces::CylinderModel* one = cylinders_.find(id);
      if (one == nullptr) continue;
      for (const auto& [other, model] : cylinders_) {
        if (other == id) continue;
        // The larger keeps its id, the older one on a tie.
        const bool into_other = one->inliers.size() < model.inliers.size() ||
                                (one->inliers.size() == model.inliers.size() && other < id);
        const CylinderId kept = into_other ? other : id, gone = into_other ? id : other;
        auto joint = joint_of(*cylinders_.find(kept), *cylinders_.find(gone));
        if (!joint) continue;
        merge(kept, gone, joint->shape);
        break;  // a third one waits until either changes again
      }
    }
  }
  void merge(CylinderId a, CylinderId b, const Shape& shape) {
    const std::map<geometry::VoxelKey, surfaces::Inlier> inliers = cylinders_.find(b)->inliers;
    cylinders_.erase(b, a);
    surfaces::CylinderModel& into = *cylinders_.find(a);
    for (const auto& [key, point] : inliers) cylinders_.add(into, point);
    into.shape = shape;
    drop_misfits(into);
    into.unchecked = 0;
  }

  const surfaces::MapView& map_;
  surfaces::CylinderStore& cylinders_;
  CylinderCriterion criterion_;
  std::span<const PointId> points_;
};

}  // namespace

void retract_cylinders(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta) {
  surfaces::CylinderStore& cylinders = ledger.cylinder_store();
  if (cylinders.size() == 0) return;
  const CylinderCriterion criterion(ledger);
  for (const occupancy::VoxelPoint& p : delta.vanished) cylinders.release(p.key);
  for (const occupancy::OccupancyDelta::Refined& r : delta.refined) {
    const CylinderId id = cylinders.owner(r.after.key);
    if (id == 0) continue;
    const double misfit = cylinders.find(id)->shape.distance(r.after.position.cast<double>());
    if (std::fabs(misfit) <= criterion.reach(r.after.range_class))
      cylinders.move({r.after.key, r.after.range_class, r.after.position});
    else
      cylinders.release(r.after.key);
  }
}

void update_cylinders(surfaces::Ledger& ledger, std::span<const PointId> points, Patches bent) {
  if (!ledger.parameters.detection.detect_cylinders) return;
  if (points.empty() && bent.empty() && ledger.cylinder_store().touched().empty()) return;
  CylinderUpdate{ledger, points}(bent);
}

}  // namespace octosurf::cylinders
