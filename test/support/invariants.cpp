#include "support/invariants.hpp"

#include "geometry/rings.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

namespace octosurf::test {
namespace {

class Checker {
 public:
  explicit Checker(const surfaces::MapState& state) : state_(state) {}

  std::vector<std::string> operator()() {
    check_points();
    for (const auto& [id, surface] : state_.surfaces) check_surface(id, surface);
    for (const auto& [id, cylinder] : state_.cylinders) check_cylinder(id, cylinder);
    check_snapshot();
    check_removals();
    return std::move(violations_);
  }

 private:
  template <class... Parts>
  void report(const Parts&... parts) {
    std::ostringstream line;
    (line << ... << parts);
    violations_.push_back(line.str());
  }

  /// Every point is an inlier of exactly one surface or pending.
  void check_points() {
    std::size_t points = 0, owned = 0;
    state_.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
      ++points;
      if (state_.occupancy.at(p.key).state != occupancy::OccupancyMap::State::occupied)
        report("voxel ", p.key.packed(), " holds a point but is not occupied");
      if (p.surface == 0) return;
      ++owned;
      const surfaces::SurfaceModel* surface = state_.surfaces.find(p.surface);
      if (surface == nullptr)
        report("voxel ", p.key.packed(), " belongs to surface ", p.surface, ", which is not there");
    });
    if (points != state_.points) report(state_.points, " points counted, ", points, " found");
    std::size_t inliers = 0;
    for (const auto& [id, surface] : state_.surfaces) inliers += surface.size();
    if (inliers != owned) report(inliers, " inliers, but ", owned, " voxels that belong to a surface");
  }

  void check_surface(SurfaceId id, const surfaces::SurfaceModel& surface) {
    const auto n = static_cast<std::size_t>(state_.parameters.min_surface_points());
    if (surface.size() < n) report("surface ", id, " has ", surface.size(), " inliers, fewer than n = ", n);
    if (id >= state_.surfaces.next_id()) report("surface ", id, " is not below the next id");
    check_plane(id, surface.plane(), surface.pose());
    geometry::Moments sums;
    for (const surfaces::Inlier& inlier : surface.sorted_inliers()) {
      sums.add(inlier.position.cast<double>() - surface.reference());
      const occupancy::OccupancyMap::Lookup voxel = state_.occupancy.at(inlier.key);
      if (!voxel.point || voxel.point->surface != id)
        report("inlier ", inlier.key.packed(), " of surface ", id, " does not say so in the octree");
      else if (voxel.point->position != inlier.position)
        report("inlier ", inlier.key.packed(), " of surface ", id, " stands elsewhere in the octree");
      const auto near = state_.surfaces.near(inlier.key, 0);
      if (std::find(near.begin(), near.end(), id) == near.end())
        report("surface ", id, " is not found at its inlier ", inlier.key.packed());
    }
    const geometry::Moments kept = surface.moments(nullptr);
    if (std::fabs(kept.count - sums.count) > 1e-6 ||
        (kept.sum - sums.sum).norm() > 1e-6 * (1 + sums.sum.norm()) ||
        (kept.outer - sums.outer).norm() > 1e-6 * (1 + sums.outer.norm()))
      report("surface ", id, "'s moments are not those of its inliers");
  }

  void check_plane(SurfaceId id, const Plane& plane, const Eigen::Isometry3d& pose) {
    if (std::fabs(plane.normal.norm() - 1) > 1e-9) report("surface ", id, "'s normal is not of length 1");
    if ((pose.linear().col(2) - plane.normal).norm() > 1e-9)
      report("surface ", id, "'s frame is not along its normal");
    if ((pose.linear().transpose() * pose.linear() - Eigen::Matrix3d::Identity()).norm() > 1e-9)
      report("surface ", id, "'s frame is not orthonormal");
    if (std::fabs(plane.signed_distance(pose.translation())) > 1e-6)
      report("surface ", id, "'s frame does not stand on its plane");
  }

  /// The voxels that support a cylinder are pending, supported by it only, and near its lateral surface.
  void check_cylinder(CylinderId id, const surfaces::CylinderModel& cylinder) {
    const auto n = static_cast<std::size_t>(state_.parameters.min_surface_points());
    if (cylinder.inliers.size() < n)
      report("cylinder ", id, " has ", cylinder.inliers.size(), " inliers, fewer than n = ", n);
    if (id >= state_.cylinders.next_id()) report("cylinder ", id, " is not below the next id");
    if (std::fabs(cylinder.shape.axis.norm() - 1) > 1e-9)
      report("cylinder ", id, "'s axis is not of length 1");
    for (const auto& [key, inlier] : cylinder.inliers) {
      const occupancy::OccupancyMap::Lookup voxel = state_.occupancy.at(key);
      if (!voxel.point || voxel.point->surface != 0)
        report("inlier ", key.packed(), " of cylinder ", id, " is not pending");
      else if (voxel.point->position != inlier.position)
        report("inlier ", key.packed(), " of cylinder ", id, " stands elsewhere in the octree");
      if (state_.cylinders.owner(key) != id)
        report("inlier ", key.packed(), " of cylinder ", id, " is held to be another's");
      if (std::fabs(cylinder.shape.distance(inlier.position.cast<double>())) >
          1.5 * state_.noise.largest_tolerance())
        report("inlier ", key.packed(), " of cylinder ", id, " is off its lateral");
    }
  }

  void check_published(const Cylinder& published, const surfaces::CylinderModel& cylinder) {
    const CylinderPtr now = cylinder.publish(published.revision);
    if (published.id != cylinder.id || published.inliers != now->inliers ||
        (published.axis_point - now->axis_point).norm() > 1e-9 ||
        (published.axis - now->axis).norm() > 1e-9 || (published.start - now->start).norm() > 1e-9 ||
        std::fabs(published.radius_m - now->radius_m) > 1e-9 ||
        std::fabs(published.length_m - now->length_m) > 1e-9 ||
        std::fabs(published.span_rad - now->span_rad) > 1e-9 ||
        std::fabs(published.rms_m - now->rms_m) > 1e-9)
      report("cylinder ", published.id, " of the snapshot is not the map's");
  }

  void check_snapshot() {
    const std::shared_ptr<const Snapshot> snapshot = state_.snapshot.read();
    if (snapshot->surfaces.size() != state_.surfaces.size())
      report("the snapshot has ", snapshot->surfaces.size(), " surfaces of ", state_.surfaces.size());
    SurfaceId last = 0;
    for (const SurfacePtr& surface : snapshot->surfaces) {
      if (surface->id <= last) report("the snapshot is not in order of id");
      last = surface->id;
      const surfaces::SurfaceModel* model = state_.surfaces.find(surface->id);
      if (model == nullptr || model->size() != surface->inliers)
        report("surface ", surface->id, " of the snapshot is not the map's");
      check_polygons(*surface);
    }
    if (snapshot->cylinders.size() != state_.cylinders.size())
      report("the snapshot has ", snapshot->cylinders.size(), " cylinders of ", state_.cylinders.size());
    for (const CylinderPtr& cylinder : snapshot->cylinders)
      if (const surfaces::CylinderModel* model = state_.cylinders.find(cylinder->id))
        check_published(*cylinder, *model);
      else
        report("cylinder ", cylinder->id, " of the snapshot is not in the map");
  }

  void check_removals() {
    std::uint64_t last = 0;
    std::set<SurfaceId> gone;
    state_.removals.for_each_since(0, [&](const Removal& removal) {
      if (removal.revision < last || removal.revision > state_.revision || removal.born > removal.revision)
        report("the removal of ", removal.id, " is out of order");
      last = removal.revision;
      if (removal.of != Removal::Of::surface) return;
      if (state_.surfaces.find(removal.id) != nullptr || removal.id >= state_.surfaces.next_id())
        report("surface ", removal.id, " has gone and is there, or never was");
      if (!gone.insert(removal.id).second) report("surface ", removal.id, " has gone twice");
    });
  }

  void check_polygons(const Surface& surface) {
    const double h = state_.parameters.max_hole_size();
    for (const Polygon& polygon : surface.polygons) {
      check_ring(surface.id, polygon.outer, true, h);
      for (const Ring2& hole : polygon.holes) check_ring(surface.id, hole, false, h);
    }
  }
  void check_ring(SurfaceId id, const Ring2& ring, bool outer, double h) {
    if (ring.size() < 3) report("surface ", id, " has a ring of ", ring.size(), " vertices");
    if ((geometry::signed_area(ring) > 0) != outer)
      report("surface ", id, " has a ring that runs the wrong way");
    for (std::size_t i = 0; i < ring.size(); ++i)
      if ((ring[i] - ring[(i + 1) % ring.size()]).norm() > h + 1e-9)
        report("surface ", id, " has boundary points more than h apart");
  }

  const surfaces::MapState& state_;
  std::vector<std::string> violations_;
};

}  // namespace

std::vector<std::string> check_invariants(const Map& map) { return Checker(surfaces::state_of(map))(); }

}  // namespace octosurf::test
