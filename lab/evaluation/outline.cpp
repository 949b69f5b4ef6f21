#include "evaluation/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace octosurf::evaluation {
namespace {

constexpr double smallest_hole_m2 = 0.02;
constexpr double smallest_hole_width = 0.1;  // m, diameter of the largest inscribed circle

bool mostly_visible(const Scene& scene, std::size_t face, const Ring2& ring) {
  std::size_t all = 0, visible = 0;
  for_each_on_ring(ring, scene.options.grid, [&](const Eigen::Vector2d& uv) {
    ++all;
    visible += scene.visible[face].near(uv, scene.reach());
  });
  return 2 * visible >= all;
}

/// Diameter of the largest circle in a ring.
double width_of(const Ring2& ring, double grid) {
  const PlanarRegion region({Polygon{ring, {}}});
  double radius = 0;
  region.for_each_cell(
      grid, [&](const Eigen::Vector2d& uv) { radius = std::max(radius, region.ring_distance(uv)); });
  return 2 * radius;
}

Eigen::Isometry3d T_surface_face(const Scene& scene, std::size_t face, std::size_t surface) {
  return scene.surfaces[surface].T_map_patch.inverse() * scene.faces[face].T_map_patch;
}

}  // namespace

void append_boundary_distances(const Scene& scene, std::size_t face, const std::vector<std::size_t>& surfaces,
                               std::vector<double>& distances) {
  const TrueFace& truth = scene.truth->faces[face];
  const VisibleCells& seen = scene.visible[face];
  const double gap = scene.options.one_plane_at(scene.snapshot->resolution).gap_m;
  std::vector<PlanarRegion> parts;  // of a joined face: its polygons
  if (!truth.joined.empty())
    for (const Polygon& polygon : truth.polygons) parts.emplace_back(std::vector{polygon});
  const auto is_joint = [&](const Eigen::Vector2d& uv, std::size_t own) {
    for (std::size_t p = 0; p < parts.size(); ++p)
      if (p != own && parts[p].within(uv, gap)) return true;
    return false;
  };
  const auto along = [&](const Ring2& ring, std::size_t part) {
    for_each_on_ring(ring, scene.options.grid, [&](const Eigen::Vector2d& uv) {
      if (!seen.near(uv, scene.reach()) || is_joint(uv, part)) return;
      double nearest = std::numeric_limits<double>::infinity();
      for (const std::size_t s : surfaces)
        nearest = std::min(nearest, scene.surfaces[s].region.ring_distance(
                                        transfer(T_surface_face(scene, face, s), uv).head<2>()));
      distances.push_back(nearest);
    });
  };
  for (std::size_t p = 0; p < truth.polygons.size(); ++p) {
    along(truth.polygons[p].outer, p);
    for (const Ring2& hole : truth.polygons[p].holes)
      if (width_of(hole, scene.options.grid) >= gap) along(hole, p);
  }
  // Of the face's plane; the face was seen there, and no surface is.
  const auto left_out = [&](const Eigen::Vector2d& uv) {
    return seen.near(uv, 0) && std::none_of(surfaces.begin(), surfaces.end(), [&](std::size_t s) {
             return scene.surfaces[s].region.within(transfer(T_surface_face(scene, face, s), uv).head<2>(),
                                                    scene.reach());
           });
  };
  for (const std::size_t s : surfaces) {
    const Eigen::Isometry3d T_face_surface = T_surface_face(scene, face, s).inverse();
    const auto from = [&](const Eigen::Vector2d& on_ring) {
      const Eigen::Vector2d uv = transfer(T_face_surface, on_ring).head<2>();
      for (int k = 0; k < 8; ++k) {
        const double turn = k * std::numbers::pi / 4;
        if (!left_out(uv + 2 * scene.reach() * Eigen::Vector2d(std::cos(turn), std::sin(turn)))) continue;
        distances.push_back(scene.faces[face].region.ring_distance(uv));
        return;
      }
    };
    for (const Polygon& polygon : scene.snapshot->surfaces[s]->polygons) {
      for_each_on_ring(polygon.outer, scene.options.grid, from);
      for (const Ring2& hole : polygon.holes) for_each_on_ring(hole, scene.options.grid, from);
    }
  }
}

std::vector<HoleScore> score_holes(const Scene& scene, std::size_t face, std::size_t surface) {
  const Eigen::Isometry3d T = T_surface_face(scene, face, surface);
  const double cell_m2 = scene.options.grid * scene.options.grid;
  std::vector<HoleScore> scores;
  for (const Polygon& polygon : scene.truth->faces[face].polygons) {
    for (const Ring2& hole : polygon.holes) {
      double radius = 0;
      std::size_t all = 0, empty = 0;
      PlanarRegion({Polygon{hole, {}}}).for_each_cell(scene.options.grid, [&](const Eigen::Vector2d& uv) {
        if (scene.faces[face].region.contains(uv)) return;  // an island
        radius = std::max(radius, scene.faces[face].region.ring_distance(uv));
        ++all;
        empty += !scene.surfaces[surface].region.contains(transfer(T, uv).head<2>());
      });
      const double area = static_cast<double>(all) * cell_m2;
      if (area < smallest_hole_m2 || 2 * radius <= smallest_hole_width ||
          !mostly_visible(scene, face, hole)) {
        continue;
      }
      const double share = static_cast<double>(empty) / static_cast<double>(all);
      scores.push_back({scene.truth->faces[face].id, area, share, share >= scene.options.threshold});
    }
  }
  return scores;
}

}  // namespace octosurf::evaluation
