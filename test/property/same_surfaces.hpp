#pragma once

#include "support/polygons.hpp"
#include "support/testing.hpp"

// Whether two maps show the same surfaces. What is compared is what lies where, not how it is cut into
// surfaces: two halves of a wall that touch in a corner of a few voxels are merged or not by one point more
// or less.

namespace octosurf::test {

/// How far what is found may differ.
struct Bounds {
  double voxels;               ///< along a surface's rings that may be missing
  double sigmas;               ///< between two planes, in units of how sure both say they are,
  double angle_deg, offset_m;  ///< and what may be added to it
};

/// The same readings in the same voxels: sums are rounded in another order, points are stored to 1/256 voxel
/// (0.08 mm, a hundredth of that in the mean of hundreds), and a few voxels on an edge may fall to the other
/// face.
inline constexpr Bounds same_voxels{0.25, 1, 0.05, 0.0001};

/// The same readings, but others of them decide for a voxel, with other weights, or the voxels are cut
/// otherwise: planes are fitted to other points. Fits to independent readings would differ by σ = √(σ₁² +
/// σ₂²); a world compares some 30 pairs in three components, and of the 10⁶ of 10,000 worlds one in three is
/// beyond 5 σ. What a covariance says is true within a fifth: 6 σ. It does not know of the readings of a
/// neighbouring face in the voxels along an edge, which hang on where these lie: 0.1° and 0.5 mm. Where noise
/// reaches a voxel beyond an edge is a matter of where the voxels' borders lie: a voxel along the rings (seed
/// 7503052: a box top of 0.42 m, 1.2 cm along its edges).
inline constexpr Bounds other_points{1, 6, 0.1, 0.0005};

inline constexpr double large = 0.12;    // m²: surfaces that must be found whatever the voxels' borders are
inline constexpr double counted = 0.05;  // m²: what a foot needs; as many of them before and after
/// Large faces that one map shows in two pieces and the other whole: four in a hundred pairs of maps have
/// one.
inline constexpr std::ptrdiff_t most_cuts = 2;

/// What of a surface's area hangs on where the voxels' borders lie: a voxel along its rings.
inline double area_in_doubt(const Surface& surface) {
  return surface.resolution * perimeter(surface.polygons);
}

inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The polygons of `s`, moved by T, as seen along the normal of `on` in its frame.
inline std::vector<Polygon> projected(const Surface& s, const Eigen::Isometry3d& T, const Surface& on) {
  const Eigen::Isometry3d T_on_s = on.T_map_surface.inverse() * T * s.T_map_surface;
  std::vector<Polygon> polygons = s.polygons;
  const auto move = [&](Ring2& ring) {
    for (Eigen::Vector2d& p : ring) p = (T_on_s * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>();
  };
  for (Polygon& polygon : polygons) {
    move(polygon.outer);
    std::for_each(polygon.holes.begin(), polygon.holes.end(), move);
  }
  return polygons;
}

/// What of `s`, moved by T, lies on `o`; nothing if they are not on one plane by far.
inline Common shared(const Surface& s, const Eigen::Isometry3d& T, const Surface& o) {
  if (angle_between(T.linear() * s.plane.normal, o.plane.normal) > 0.1) return {};
  const Common common = intersection(projected(s, T, o), o.polygons);
  if (std::fabs(s.plane.signed_distance(T.inverse() * o.to_map(common.centroid))) > 0.03) return {};
  return common;
}

/// How sure a plane says it is of its height at `at` (map frame).
inline double offset_std_at(const Surface& s, const Eigen::Vector3d& at) {
  const Eigen::Vector3d uv = s.T_map_surface.inverse() * at;
  const Eigen::Vector3d row(uv.x(), uv.y(), 1);  // off = c + a·u + b·v
  return std::sqrt(row.dot(s.covariance * row));
}

/// What lies on both `s`, moved by T, and `o` is on one plane. `at`: there, on o.
inline void expect_one_plane(const Surface& s, const Surface& o, const Eigen::Isometry3d& T,
                             const Eigen::Vector3d& at, const Bounds& bounds) {
  const Eigen::Vector3d before = T.inverse() * at;
  const double tilt_rad = angle_between(T.linear() * s.plane.normal, o.plane.normal);
  const double tilt_std_rad = std::hypot(s.normal_std_rad(), o.normal_std_rad());
  EXPECT_LE(tilt_rad * 180 / std::numbers::pi,
            bounds.angle_deg + bounds.sigmas * tilt_std_rad * 180 / std::numbers::pi);
  EXPECT_LE(std::fabs(s.plane.signed_distance(before)),
            bounds.offset_m + bounds.sigmas * std::hypot(offset_std_at(s, before), offset_std_at(o, at)));
}

/// Every large surface of `a`, moved by T, lies on surfaces of `b`, and on the same planes.
inline void expect_follow(const std::vector<SurfacePtr>& a, const std::vector<SurfacePtr>& b,
                          const Eigen::Isometry3d& T, const Bounds& bounds) {
  std::size_t compared = 0;
  for (const SurfacePtr& s : a) {
    if (s->area_m2 < large) continue;
    ++compared;
    SCOPED_TRACE("surface " + std::to_string(s->id) + " of " + std::to_string(s->area_m2) + " m²");
    double missing = s->area_m2;
    for (const SurfacePtr& o : b) {
      const Common common = shared(*s, T, *o);
      missing -= common.area;
      if (common.area < large) continue;
      // Two halves of a face are fitted to other points than the whole.
      const bool same_cut = std::fabs(o->area_m2 - s->area_m2) < 0.1 * s->area_m2;
      expect_one_plane(*s, *o, T, o->to_map(common.centroid), same_cut ? bounds : other_points);
    }
    EXPECT_LE(missing, bounds.voxels * area_in_doubt(*s));
  }
  EXPECT_GE(compared, 4U);
}

/// `b` has as many surfaces that count as `a`, of what a cut may have divided one; one whose area is in doubt
/// may stand on either side of the line.
inline void expect_as_many(const std::vector<SurfacePtr>& a, const std::vector<SurfacePtr>& b,
                           const Eigen::Isometry3d& T) {
  std::vector<std::size_t> face(a.size());  // surfaces of a that lie on one surface of b are one face
  std::iota(face.begin(), face.end(), 0);
  for (const SurfacePtr& o : b) {
    std::size_t first = a.size();
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (shared(*a[i], T, *o).area < 0.5 * a[i]->area_m2) continue;
      if (first == a.size()) first = face[i];
      std::replace(face.begin(), face.end(), face[i], first);
    }
  }
  std::vector<double> certain(a.size(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) certain[face[i]] += a[i]->area_m2 - area_in_doubt(*a[i]);
  const auto faces =
      std::count_if(certain.begin(), certain.end(), [](double area) { return area >= counted; });
  const auto possible = std::count_if(
      b.begin(), b.end(), [](const SurfacePtr& s) { return s->area_m2 + area_in_doubt(*s) >= counted; });
  EXPECT_LE(faces, possible);
  const auto pieces = std::count_if(
      a.begin(), a.end(), [](const SurfacePtr& s) { return s->area_m2 - area_in_doubt(*s) >= counted; });
  EXPECT_LE(pieces, faces + most_cuts);
}

inline void expect_same(const std::vector<SurfacePtr>& a, const std::vector<SurfacePtr>& b,
                        const Eigen::Isometry3d& T, const Bounds& bounds) {
  expect_follow(a, b, T, bounds);
  expect_follow(b, a, T.inverse(), bounds);
  expect_as_many(a, b, T);
  expect_as_many(b, a, T.inverse());
}

}  // namespace octosurf::test
