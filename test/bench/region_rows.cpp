#include "bench/region_rows.hpp"

#include "bench/support.hpp"
#include "planning/convex_sides.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <numbers>
#include <random>

#include <octosurf/contact.hpp>

namespace octosurf::bench {

std::vector<std::string> time_regions(const std::string& name, const Surface& surface) {
  std::vector<double> region_ms, pieces_ms, covered;
  double parts = 0, pieces = 0;
  constexpr int headings = 8;
  for (int i = 0; i < headings; ++i) {
    ContactRegion region;
    region_ms.push_back(time_ms([&] {
      region =
          contact_region(surface, ContactShape::rectangle(0.22, 0.11), 0.1 + i * std::numbers::pi / headings);
    }));
    std::vector<ConvexPiece> cut;
    pieces_ms.push_back(time_ms([&] { cut = convex_pieces(surface, region, 12); }));
    double area = 0;
    for (const ConvexPiece& piece : cut) {
      Ring2 ring;
      for (const Eigen::Vector3d& v : piece.vertices)
        ring.emplace_back((surface.T_map_surface.inverse() * v).head<2>());
      area += planning::area_of(ring);
    }
    if (region.area_m2 > 0) covered.push_back(area / region.area_m2);
    parts += static_cast<double>(region.polygons.size()) / headings;
    pieces += static_cast<double>(cut.size()) / headings;
  }
  return {name,
          std::to_string(surface.boundary.size()),
          fixed(percentile(region_ms, 0.5), 2),
          fixed(percentile(region_ms, 1), 2),
          fixed(parts, 1),
          fixed(100 * percentile(covered, 0), 1),
          fixed(pieces, 1),
          fixed(percentile(pieces_ms, 0.5), 1)};
}

Surface hall(std::size_t points) {
  std::mt19937_64 rng(1);  // fixed: the same hall in every run
  std::uniform_real_distribution<double> uniform(-0.01, 0.01);
  const auto rough = [&](double u, double v, double width, double height) {
    Ring2 ring;
    const Ring2 corners{{u, v}, {u + width, v}, {u + width, v + height}, {u, v + height}};
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d &from = corners[i], &to = corners[(i + 1) % 4];
      const int steps = static_cast<int>((to - from).norm() / 0.03);
      for (int k = 0; k < steps; ++k)
        ring.push_back(from + (to - from) * k / steps + Eigen::Vector2d(uniform(rng), uniform(rng)));
    }
    return ring;
  };
  // Half of the points are walls', 30 m × 45 m for 10,000; the others racks' of 1.2 m × 0.6 m.
  const double side = 0.03 * static_cast<double>(points) / 10;
  Polygon floor{rough(0, 0, side, 1.5 * side), {}};
  const std::size_t racks = points / 2 / 120;
  for (std::size_t i = 0; i < racks; ++i) {
    Ring2 rack = rough(1 + 3.0 * static_cast<double>(i % 8), 1 + 2.0 * static_cast<double>(i / 8), 1.2, 0.6);
    std::reverse(rack.begin(), rack.end());
    floor.holes.push_back(std::move(rack));
  }
  Surface surface;
  surface.resolution = 0.02;
  planning::for_each_edge(floor, [&](const Eigen::Vector2d& a, const Eigen::Vector2d&) {
    surface.boundary.emplace_back(a.x(), a.y(), 0);
  });
  surface.polygons.push_back(std::move(floor));
  surface.area_m2 = planning::area_of(surface.polygons);
  return surface;
}

}  // namespace octosurf::bench
