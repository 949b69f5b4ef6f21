#include "io/exporters/export_formats.hpp"
#include "io/exporters/planner_pieces.hpp"
#include "io/new_file.hpp"

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

#include <octosurf/planner_formats.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
using Ring3 = std::vector<Eigen::Vector3d>;

/// Starts at the corner where the first three vertices form the largest triangle.
Ring3 from_widest_corner(const Ring3& ring) {
  std::size_t best = 0;
  double largest = -1;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector3d& first = ring[i];
    const double twice_area =
        (ring[(i + 1) % ring.size()] - first).cross(ring[(i + 2) % ring.size()] - first).norm();
    if (twice_area <= largest) continue;
    largest = twice_area;
    best = i;
  }
  Ring3 turned(ring.begin() + static_cast<std::ptrdiff_t>(best), ring.end());
  turned.insert(turned.end(), ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(best));
  return turned;
}

Json piece_json(SurfaceId id, const Eigen::Vector3d& normal, const Ring3& piece) {
  const Ring3 ring = from_widest_corner(piece);
  Json vertices = Json::array(), a = Json::array(), b = Json::array();
  const auto add_row = [&](const Eigen::Vector3d& row) {
    double bound = row.dot(ring.front());
    for (const Eigen::Vector3d& vertex : ring) bound = std::max(bound, row.dot(vertex));
    a.push_back(row);
    b.push_back(bound);
  };
  for (std::size_t i = 0; i < ring.size(); ++i) {
    vertices.push_back(io::tidy(ring[i], id));
    add_row((ring[(i + 1) % ring.size()] - ring[i]).cross(normal).normalized());
  }
  add_row(normal);
  add_row(-normal);
  return {{"id", id},
          {"vertices", std::move(vertices)},
          {"normal", normal},
          {"A", std::move(a)},
          {"b", std::move(b)}};
}

}  // namespace

void export_sl1m(const std::vector<PlannerSurface>& surfaces, const std::filesystem::path& file, bool force) {
  io::NewFile output(file, force);
  io::require_pieces(surfaces, file);
  output.write([&](std::ostream& out) {
    const char* separator = "[\n";
    for (const PlannerSurface& surface : surfaces)
      for (const ConvexPiece& piece : surface.pieces) {
        out << separator << piece_json(surface.id, surface.T_world_surface.linear().col(2), piece.vertices);
        separator = ",\n";
      }
    out << "\n]\n";
  });
  output.commit();
}

}  // namespace octosurf
