#include "surfaces/intersections.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::surfaces {
namespace {

/// Of the angle between two planes: from 20° on, the error of their line is at most three times their own.
constexpr double least_sine = 1.0 / 3;

/// Effort: of a cell, to which intersections are rounded, so that a site changes only when the planes have
/// moved by that much. The rounding moves a site by at most a sixteenth of a voxel along each axis.
constexpr double intersection_quantum = 1.0 / 8;
Eigen::Vector2d rounded(const Eigen::Vector2d& outline_point) {
  return (outline_point / intersection_quantum).array().round() * intersection_quantum;
}

int cells(double length, double resolution) { return static_cast<int>(length / resolution + 1e-9); }

/// m: from an inlier back to the next row of inliers, straight or one cell aside, at most `farthest`; one
/// cell if there is none, because the density is then unknown.
double row_spacing(const SurfaceModel& surface, const Eigen::Vector3d& inlier, const Eigen::Vector3d& outward,
                   double farthest) {
  const double d = surface.resolution();
  const Eigen::Vector3d aside = surface.plane().normal.cross(outward);
  for (int k = 1; k <= cells(farthest, d); ++k)
    for (const int sideways : {0, -1, 1}) {
      const Eigen::Vector3d at = inlier - k * d * outward + sideways * d * aside;
      if (surface.occupied(surface.cell_of(at.cast<float>()))) return k * d;
    }
  return d;
}

class Intersections {
 public:
  Intersections(const SurfaceModel& surface, const SurfaceStore& surfaces, double gap)
      : surface_(surface), surfaces_(surfaces), gap_(gap) {}

  /// Finds the surfaces that may be met from a tile of the surface's hash, for for_each_from(). False if
  /// there is none.
  bool look_about(geometry::PlaneCell tile) {
    others_.clear();
    constexpr double half_diagonal = 5.66;  // cells, of a tile: 4 √2
    const Eigen::Vector3d centre = surface_.centre_of({tile.u * 8 + 4, tile.v * 8 + 4});
    const double d = surface_.resolution(), reach = half_diagonal * d + gap_;
    geometry::VoxelKey key;
    if (!geometry::VoxelGrid(d).key_of(centre.cast<float>(), key)) return false;
    const int voxels = 1 + cells(reach, d);
    for (const Other& other : in_regions_near(key, voxels))
      if (std::fabs(other.surface->plane().signed_distance(centre)) <= other.sine * reach + d)
        others_.push_back(other);
    if (others_.empty()) return false;
    const SurfaceStore::Ids near = surfaces_.near(key, voxels);
    std::erase_if(others_, [&](const Other& other) {
      return !std::binary_search(near.begin(), near.end(), other.surface->id());
    });
    return !others_.empty();
  }

  /// Calls visit(place) with places on the surface's plane: its intersections with others straight on from
  /// one of its inliers, and those of three planes.
  template <class Visit>
  void for_each_from(const Inlier& inlier, Visit&& visit) const {
    struct Met {
      const Plane* plane;
      double way;
    };
    std::vector<Met> met;
    const double d = surface_.resolution();
    const Plane& plane = surface_.plane();
    const Eigen::Vector3d p = inlier.position.cast<double>();
    const Eigen::Vector3d from = p - plane.signed_distance(p) * plane.normal;
    for (const Other& other : others_) {
      const Plane& its = other.surface->plane();
      const double along = -its.signed_distance(from) / other.sine, way = std::fabs(along);
      if (way > gap_) continue;
      const Eigen::Vector3d outward = std::copysign(1.0, along) * other.toward;
      if (surface_.occupied(surface_.cell_of((from + d * outward).cast<float>()))) continue;  // inside
      if (way > row_spacing(surface_, from, outward, gap_ - d) + d / other.sine) continue;
      const Eigen::Vector3d at = from + along * other.toward;
      if (!begins_near(other, at)) continue;
      visit(at);
      for (const Met& before : met) {
        Eigen::Matrix3d normals;
        normals << plane.normal.transpose(), its.normal.transpose(), before.plane->normal.transpose();
        const Eigen::Vector3d corner =
            normals.inverse() * Eigen::Vector3d(plane.offset, its.offset, before.plane->offset);
        // In a corner sharper than a right angle its tip lies farther off.
        if ((corner - from).norm() <= way + before.way) visit(corner);
      }
      met.push_back({&its, way});
    }
  }

 private:
  struct Other {
    const SurfaceModel* surface;
    Eigen::Vector3d toward;  // unit, in the plane, of increasing distance to the other's plane
    double sine;             // of the angle between the two
  };

  /// Those at an angle of the store's. Adjacent tiles mostly need the same regions.
  const std::vector<Other>& in_regions_near(geometry::VoxelKey key, int reach) {
    std::uint64_t regions = 0;
    for (const int k :
         {key.x - reach, key.y - reach, key.z - reach, key.x + reach, key.y + reach, key.z + reach})
      regions = regions << 10 |
                static_cast<std::uint64_t>(geometry::VoxelGrid::clamped(k) >> SurfaceStore::region_bits);
    const auto known = in_regions_.find(regions);
    if (known != in_regions_.end()) return known->second;
    std::vector<Other> found;
    const Eigen::Vector3d& normal = surface_.plane().normal;
    for (const SurfaceId id : surfaces_.in_regions_near(key, reach)) {
      const SurfaceModel& other = *surfaces_.find(id);
      const Eigen::Vector3d across = other.plane().normal - normal.dot(other.plane().normal) * normal;
      if (const double sine = across.norm(); id != surface_.id() && sine >= least_sine)
        found.push_back({&other, across / sine, sine});
    }
    return in_regions_.emplace(regions, std::move(found)).first->second;
  }

  /// Whether the other surface's inliers start as near to a place on its plane as their mutual spacing.
  bool begins_near(const Other& other, const Eigen::Vector3d& at) const {
    const SurfaceModel& surface = *other.surface;
    const double d = surface.resolution();
    const auto nearest = surface.nearest(surface.cell_of(at.cast<float>()), cells(gap_, d));
    if (!nearest) return false;
    const Eigen::Vector3d first = surface.centre_of(*nearest), way = at - first;
    if (way.norm() > gap_) return false;
    Eigen::Vector3d outward =
        surface.plane().normal.cross(surface_.plane().normal.cross(surface.plane().normal));
    outward *= std::copysign(1 / outward.norm(), outward.dot(way));
    const double half_a_cell = 0.5 * d;  // `first` is a cell's centre
    return outward.dot(way) <= row_spacing(surface, first, outward, gap_ - d) + d / other.sine + half_a_cell;
  }

  const SurfaceModel& surface_;
  const SurfaceStore& surfaces_;
  double gap_;
  std::vector<Other> others_;
  tsl::robin_map<std::uint64_t, std::vector<Other>, geometry::PackedKeyHash>
      in_regions_;  // earlier look-ups, by first and last
};

}  // namespace

IntersectionSites find_intersections(const SurfaceModel& surface, const SurfaceStore& others, double gap) {
  IntersectionSites found;
  Intersections intersections(surface, others, gap);
  for (const geometry::CellBits::Cells& boundary : surface.raster().boundary())
    if (intersections.look_about(boundary.tile))
      boundary.for_each([&](geometry::PlaneCell cell) {
        surface.inliers().for_each_in(cell, [&](const Inlier& inlier) {
          intersections.for_each_from(inlier, [&](const Eigen::Vector3d& p) {
            found[cell.packed()].push_back(rounded(surface.outline_point(p.cast<float>())));
          });
        });
      });
  return found;
}

}  // namespace octosurf::surfaces
