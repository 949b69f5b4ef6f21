#include "surfaces/intersections.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

namespace octosurf::surfaces {
namespace {

/// Of the angle between two planes: from 20° on, the error of their line is at most three times their own.
constexpr double least_sine = 1.0 / 3;

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

/// Effort: of a cell, to which intersections are rounded, so that a site changes only when the planes have
/// moved by that much. The rounding moves a site by at most a sixteenth of a voxel along each axis.
constexpr double intersection_quantum = 1.0 / 8;
Eigen::Vector2d rounded(const Eigen::Vector2d& outline_point) {
  return (outline_point / intersection_quantum).array().round() * intersection_quantum;
}

class Intersections {
 public:
  Intersections(const SurfaceModel& surface, const SurfaceStore& surfaces, double gap)
      : surface_(surface), surfaces_(surfaces), gap_(gap) {}

  /// Finds the surfaces that may be met from a tile of the surface's hash, for points_from(). False if there
  /// is none.
  bool look_about(geometry::PlaneCell tile);
  /// On the surface's plane: its intersections with others straight on from one of its inliers, and those of
  /// three planes. Empties `points` first.
  void points_from(const Inlier& inlier, std::vector<Eigen::Vector3d>& points) const;

 private:
  struct Other {
    const SurfaceModel* surface;
    Eigen::Vector3d toward;  // unit, in the plane, of increasing distance to the other's plane
    double sine;             // of the angle between the two
  };
  const SurfaceStore::Ids& in_regions_near(geometry::VoxelKey key, int reach);
  bool begins_near(const Other& other, const Eigen::Vector3d& at) const;

  const SurfaceModel& surface_;
  const SurfaceStore& surfaces_;
  double gap_;
  std::vector<Other> others_;
  std::map<std::uint64_t, SurfaceStore::Ids> in_regions_;  // cache of earlier look-ups, by first and last
};

/// As the store's. Adjacent tiles mostly need the same regions.
const SurfaceStore::Ids& Intersections::in_regions_near(geometry::VoxelKey key, int reach) {
  std::uint64_t regions = 0;
  for (const int k :
       {key.x - reach, key.y - reach, key.z - reach, key.x + reach, key.y + reach, key.z + reach})
    regions =
        regions << 10 | static_cast<std::uint64_t>(std::clamp(k, 0, 65535) >> SurfaceStore::region_bits);
  const auto known = in_regions_.find(regions);
  if (known != in_regions_.end()) return known->second;
  return in_regions_.emplace(regions, surfaces_.in_regions_near(key, reach)).first->second;
}

bool Intersections::look_about(geometry::PlaneCell tile) {
  others_.clear();
  constexpr double half_diagonal = 5.66;  // cells, of a tile: 4 √2
  const Eigen::Vector3d centre = surface_.centre_of({tile.u * 8 + 4, tile.v * 8 + 4});
  const double d = surface_.resolution(), reach = half_diagonal * d + gap_;
  geometry::VoxelKey key;
  if (!geometry::VoxelGrid(d).key_of(centre.cast<float>(), key)) return false;
  const Eigen::Vector3d& normal = surface_.plane().normal;
  const int voxels = 1 + cells(reach, d);
  for (const SurfaceId id : in_regions_near(key, voxels)) {
    if (id == surface_.id()) continue;
    const SurfaceModel& other = *surfaces_.find(id);
    const Eigen::Vector3d across = other.plane().normal - normal.dot(other.plane().normal) * normal;
    const double sine = across.norm();
    if (sine < least_sine) continue;
    if (std::fabs(other.plane().signed_distance(centre)) > sine * reach + d) continue;
    others_.push_back({&other, across / sine, sine});
  }
  if (others_.empty()) return false;
  const SurfaceStore::Ids near = surfaces_.near(key, voxels);
  std::erase_if(others_, [&](const Other& other) {
    return !std::binary_search(near.begin(), near.end(), other.surface->id());
  });
  return !others_.empty();
}

/// Whether the other surface's inliers start as near to a place on its plane as their mutual spacing.
bool Intersections::begins_near(const Other& other, const Eigen::Vector3d& at) const {
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

void Intersections::points_from(const Inlier& inlier, std::vector<Eigen::Vector3d>& points) const {
  points.clear();
  struct Met {
    const SurfaceModel* surface;
    double way;
  };
  std::vector<Met> met;
  const double d = surface_.resolution();
  const Plane& plane = surface_.plane();
  const Eigen::Vector3d p = inlier.position.cast<double>();
  const Eigen::Vector3d from = p - plane.signed_distance(p) * plane.normal;
  for (const Other& other : others_) {
    const double along = -other.surface->plane().signed_distance(from) / other.sine, way = std::fabs(along);
    if (way > gap_) continue;
    const Eigen::Vector3d outward = std::copysign(1.0, along) * other.toward;
    if (surface_.occupied(surface_.cell_of((from + d * outward).cast<float>()))) continue;  // inside
    if (way > row_spacing(surface_, from, outward, gap_ - d) + d / other.sine) continue;
    const Eigen::Vector3d at = from + along * other.toward;
    if (!begins_near(other, at)) continue;
    points.push_back(at);
    for (const Met& before : met) {
      Eigen::Matrix3d normals;
      normals << plane.normal.transpose(), other.surface->plane().normal.transpose(),
          before.surface->plane().normal.transpose();
      const Eigen::Vector3d corner =
          normals.inverse() *
          Eigen::Vector3d(plane.offset, other.surface->plane().offset, before.surface->plane().offset);
      // In a corner sharper than a right angle its tip lies farther off.
      if ((corner - from).norm() <= way + before.way) points.push_back(corner);
    }
    met.push_back({other.surface, way});
  }
}

}  // namespace

IntersectionSites find_intersections(const SurfaceModel& surface, const SurfaceStore& others, double gap) {
  IntersectionSites found;
  Intersections intersections(surface, others, gap);
  std::vector<Eigen::Vector3d> points;
  std::vector<IntersectionSite> sites;
  for (const geometry::CellBits::Cells& boundary : surface.boundary_cells()) {
    if (!intersections.look_about(boundary.tile)) continue;
    sites.clear();
    boundary.for_each([&](geometry::PlaneCell cell) {
      const auto bit = static_cast<std::uint8_t>(geometry::CellBits::bit_of(cell));
      surface.for_each_inlier_in(cell, [&](const Inlier& inlier) {
        intersections.points_from(inlier, points);
        for (const Eigen::Vector3d& p : points)
          sites.push_back({bit, rounded(surface.outline_point(p.cast<float>()))});
      });
    });
    if (!sites.empty()) found.emplace(boundary.tile.packed(), sites);
  }
  return found;
}

}  // namespace octosurf::surfaces
