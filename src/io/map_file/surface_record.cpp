#include "geometry/ring_check.hpp"
#include "io/map_file/record_numbers.hpp"
#include "io/map_file/records.hpp"
#include "map_file.pb.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace octosurf::io {
namespace {

using State = surfaces::SurfaceModel::State;

// Per inlier, and the weight of one: surfaces forget at a hundred readings, and weights are squared ratios of
// noises from 1 µm on.
constexpr double most_readings = 1e4, most_weight = 1e8;
constexpr double rotation_slack = 1e-6;
constexpr double plane_slack = 1e-4;    // m
constexpr double edge_slack = 1e-6;     // relative
constexpr double moments_slack = 1e-3;  // relative: accumulated rounding of millions of changes

/// Reads or writes its lists of numbers.
void visit(map_file::Surface& record, State& s, const Damage* damage) {
  visit_numbers(record.mutable_plane(), damage, finite_numbers, s.plane.normal, s.plane.offset);
  visit_numbers(record.mutable_pose(), damage, finite_numbers, s.pose);
  visit_numbers(record.mutable_hash_frame(), damage, finite_numbers, s.hash_frame);
  visit_numbers(record.mutable_reference(), damage, finite_numbers, s.reference);
  RecordNumbers<double> moments(*record.mutable_moments(), damage, finite_numbers);
  for (geometry::Moments& m : s.moments) moments(m.count, m.sum, m.outer);
  if (damage) damage->require(moments.at_end(), "lacks numbers, or has too many");
  geometry::Moments& seen = s.evidence.moments;
  if (damage ? record.evidence_size() > 0 : s.evidence.readings > 0)
    visit_numbers(record.mutable_evidence(), damage, finite_numbers, s.evidence.readings, seen.count,
                  seen.sum, seen.outer);
  Eigen::Matrix3d& c = s.covariance;
  visit_numbers(record.mutable_covariance(), damage, finite_numbers, c(0, 0), c(0, 1), c(0, 2), c(1, 1),
                c(1, 2), c(2, 2));
}

/// Reads or writes polygons with coordinates up to `reach`.
void visit(map_file::Polygons& record, std::vector<Polygon>& polygons, const Damage* damage, double reach) {
  RecordNumbers<double> uv(*record.mutable_uv(), damage,
                           {reach, "has a polygon outside the octree, or not finite"});
  int rings = 0;
  const auto visit_ring = [&](Ring2& ring) {
    if (damage) {
      ring.resize(record.vertices(rings++));
      damage->require(ring.size() >= 3, "has a ring of fewer than three vertices");
    } else {
      record.add_vertices(static_cast<std::uint32_t>(ring.size()));
    }
    for (Eigen::Vector2d& p : ring) uv(p);
  };
  const auto visit_polygon = [&](Polygon& polygon) {
    visit_ring(polygon.outer);
    for (Ring2& hole : polygon.holes) visit_ring(hole);
  };
  if (!damage) {
    for (Polygon& polygon : polygons) {
      record.add_rings(static_cast<std::uint32_t>(1 + polygon.holes.size()));
      visit_polygon(polygon);
    }
    return;
  }
  const auto total = [](const auto& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  };
  damage->require(total(record.rings()) == static_cast<std::uint64_t>(record.vertices_size()) &&
                      2 * total(record.vertices()) == static_cast<std::uint64_t>(record.uv_size()),
                  "has polygons that do not add up");
  for (const std::uint32_t count : record.rings()) {
    damage->require(count > 0, "has a polygon without rings");
    polygons.emplace_back().holes.resize(count - 1);
    visit_polygon(polygons.back());
  }
}

bool has_long_edge(const Ring2& ring, double longest) {
  for (std::size_t i = 0; i < ring.size(); ++i)
    if ((ring[i] - ring[i + 1 < ring.size() ? i + 1 : 0]).norm() > longest) return true;
  return false;
}

/// Checks plane and frames; `reach` is eight times the octree's range, so that hash cells fit their integers.
void check_frames(const State& s, const Damage& damage, double reach) {
  damage.require(std::fabs(s.plane.normal.norm() - 1) <= rotation_slack,
                 "has a normal that is not of length 1");
  bool near = std::fabs(s.plane.offset) <= 2 * reach && s.reference.cwiseAbs().maxCoeff() <= reach;
  for (const Eigen::Isometry3d& T : {s.pose, s.hash_frame}) {
    const Eigen::Matrix3d R = T.linear();
    damage.require(
        (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= rotation_slack &&
            R.determinant() > 0,
        "has a frame that is not a rigid motion");
    near &= T.translation().cwiseAbs().maxCoeff() <= reach;
  }
  damage.require(near, "lies far outside the octree");
  damage.require((s.pose.linear().col(2) - s.plane.normal).norm() <= rotation_slack &&
                     std::fabs(s.plane.signed_distance(s.pose.translation())) <= plane_slack,
                 "has a frame that is not its plane's");
}

/// Of a surface with `inliers`, which are not looked at.
void check_evidence(const State& s, std::uint64_t inliers, const Damage& damage, double reach) {
  const geometry::Moments& m = s.evidence.moments;
  const auto bounded = [&](const auto& x, double limit) { return x.cwiseAbs().maxCoeff() <= limit; };
  const double readings = most_readings * static_cast<double>(inliers);
  damage.require(s.evidence.readings >= 0 && s.evidence.readings <= readings && m.count >= 0 &&
                     m.count <= most_weight * readings && bounded(m.sum, reach * m.count + plane_slack) &&
                     bounded(m.outer, reach * reach * m.count + plane_slack) &&
                     m.outer.diagonal().minCoeff() >= 0 &&
                     m.outer.isApprox(m.outer.transpose(), moments_slack),
                 "has evidence that no scan gives");
}

constexpr double length_slack = 1e-6;
constexpr double largest_radius = 10;  // m: far larger than any detected cylinder

void visit(map_file::Cylinder& record, geometry::CylinderShape& shape, const Damage* damage) {
  visit_numbers(record.mutable_shape(), damage, finite_numbers, shape.point, shape.axis, shape.radius);
}

}  // namespace

void write_surface(State& surface, std::uint64_t inliers, map_file::Surface& record) {
  record.set_id(surface.id);
  visit(record, surface, nullptr);
  visit(*record.mutable_polygons(), surface.polygons, nullptr, 0);
  for (const SurfaceId parent : surface.parents) record.add_parents(parent);
  record.set_polygons_stale(surface.polygons_stale);
  if (surface.born > 0) record.set_born(surface.born);
  record.set_revision(surface.revision);
  if (surface.checked_size > 0) record.set_checked_inliers(surface.checked_size);
  record.set_inliers(inliers);
}

void require_inliers(const State& s, std::uint64_t inliers, const std::string& where) {
  const Damage damage{where, "surface " + std::to_string(s.id) + " "};
  damage.require(inliers == s.inliers.size() && inliers > 0, "has other inliers than the octree");
  std::array<geometry::Moments, sensing::NoiseModel::classes> sums;
  for (const surfaces::Inlier& inlier : s.inliers)
    sums[inlier.range_class].add(inlier.position.cast<double>() - s.reference);
  const auto near = [](const auto& a, const auto& b) {
    return (a - b).norm() <= moments_slack * (1 + b.norm());
  };
  for (std::size_t c = 0; c < s.moments.size(); ++c)
    damage.require(s.moments[c].count == sums[c].count && near(s.moments[c].sum, sums[c].sum) &&
                       near(s.moments[c].outer, sums[c].outer),
                   "has moments that are not its inliers'");
}

State read_surface(map_file::Surface& record, const SurfaceLimits& limits, const std::string& where) {
  const Damage damage{where, "surface " + std::to_string(record.id()) + " "};
  const auto require = [&](bool holds, const char* what) { damage.require(holds, what); };
  const double reach = std::ldexp(limits.parameters.occupancy.resolution, 18);
  State s;
  s.id = record.id();
  visit(record, s, &damage);
  check_frames(s, damage, reach);
  check_evidence(s, record.inliers(), damage, reach);
  s.covariance = Eigen::Matrix3d(s.covariance.selfadjointView<Eigen::Upper>());
  require(s.covariance.cwiseAbs().maxCoeff() <= reach * reach && s.covariance.llt().info() == Eigen::Success,
          "has a covariance that no fit gives");
  visit(*record.mutable_polygons(), s.polygons, &damage, 2 * reach);
  if (const auto fault = geometry::fault_of(s.polygons)) damage.fail("has " + std::string(*fault));
  const double longest = limits.parameters.max_hole_size() * (1 + edge_slack);
  for (const Polygon& polygon : s.polygons)
    require(!has_long_edge(polygon.outer, longest) &&
                std::ranges::none_of(polygon.holes,
                                     [&](const Ring2& hole) { return has_long_edge(hole, longest); }),
            "has boundary points more than h apart");
  s.parents.assign(record.parents().begin(), record.parents().end());
  require(std::ranges::all_of(s.parents, [&](SurfaceId id) { return id > 0 && id < limits.next_id; }),
          "has a parent that never was");
  s.polygons_stale = record.polygons_stale();
  s.born = record.born();
  s.revision = record.revision();
  s.checked_size = record.checked_inliers();
  require(s.checked_size <= largest_count, "has counts that make no sense");
  require(record.has_polygons_stale() && record.has_revision() && s.revision <= limits.revision,
          "has no revision, or one that is to come");
  require(s.born <= s.revision, "changed before it was there");
  return s;
}

void write_cylinder(surfaces::CylinderModel cylinder, map_file::Cylinder& record) {
  record.set_id(cylinder.id);
  visit(record, cylinder.shape, nullptr);
  KeySteps steps;
  for (const auto& [key, inlier] : cylinder.inliers) record.add_steps(steps.to(key));
  if (cylinder.born > 0) record.set_born(cylinder.born);
  record.set_revision(cylinder.revision);
  record.set_unchecked(cylinder.unchecked);
}

surfaces::CylinderModel read_cylinder(map_file::Cylinder& record, const surfaces::MapState& state,
                                      const std::string& where) {
  const Damage damage{where, "cylinder " + std::to_string(record.id()) + " "};
  const auto require = [&](bool holds, const char* what) { damage.require(holds, what); };
  surfaces::CylinderModel cylinder;
  cylinder.id = record.id();
  visit(record, cylinder.shape, &damage);
  require(std::fabs(cylinder.shape.axis.norm() - 1) <= length_slack, "has an axis that is not of length 1");
  require(cylinder.shape.radius > 0 && cylinder.shape.radius <= largest_radius,
          "has a radius that makes no sense");
  require(cylinder.shape.point.cwiseAbs().maxCoeff() <= std::ldexp(state.parameters.occupancy.resolution, 18),
          "lies far outside the octree");
  KeySteps steps;
  for (const std::uint64_t step : record.steps()) {
    const auto key = steps.from(step);
    if (!key) damage.fail("has voxels outside the octree, or out of order");
    const auto point = state.occupancy.at(*key).point;
    const CylinderId owner = state.cylinders.owner(*key);
    require(point && point->surface == 0 && (owner == 0 || owner == cylinder.id),
            "has a voxel that is not pending, or another's");
    const double misfit = std::fabs(cylinder.shape.distance(point->position.cast<double>()));
    require(misfit <= 1.5 * state.noise.largest_tolerance(), "has a voxel off its lateral");
    cylinder.inliers[*key] = {*key, point->range_class, point->position};
  }
  require(cylinder.inliers.size() >= static_cast<std::size_t>(state.parameters.min_surface_points()),
          "has fewer than n voxels");
  require(record.has_revision() && record.revision() <= state.revision,
          "has no revision, or one that is to come");
  require(record.has_unchecked() && record.unchecked() <= largest_count, "lacks numbers");
  cylinder.born = record.born();
  cylinder.revision = record.revision();
  require(cylinder.born <= cylinder.revision, "changed before it was there");
  cylinder.unchecked = record.unchecked();
  return cylinder;
}

}  // namespace octosurf::io
