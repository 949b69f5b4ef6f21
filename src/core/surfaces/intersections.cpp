#include "surfaces/intersections.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

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

}  // namespace

/// As the store's. Adjacent tiles mostly need the same regions.
const std::vector<SurfaceId>& Intersections::in_regions_near(geometry::VoxelKey key, int reach) {
  std::uint64_t regions = 0;
  for (const int k :
       {key.x - reach, key.y - reach, key.z - reach, key.x + reach, key.y + reach, key.z + reach})
    regions =
        regions << 10 | static_cast<std::uint64_t>(std::clamp(k, 0, 65535) >> SurfaceStore::region_bits);
  const auto known = in_regions_.find(regions);
  if (known != in_regions_.end()) return known->second;
  const SurfaceStore::Ids found = surfaces_.in_regions_near(key, reach);
  return in_regions_.emplace(regions, std::vector<SurfaceId>(found.begin(), found.end())).first->second;
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

}  // namespace octosurf::surfaces
