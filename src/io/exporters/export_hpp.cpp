#include "io/exporters/export_formats.hpp"
#include "io/exporters/planner_pieces.hpp"
#include "io/new_file.hpp"
#include "io/new_folder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/planner_formats.hpp>

namespace octosurf {
namespace {

using Ring3 = std::vector<Eigen::Vector3d>;

/// How coarse 32-bit floats are at the largest coordinate.
double float_spacing(const std::vector<PlannerSurface>& surfaces) {
  double largest = 0;
  for (const PlannerSurface& surface : surfaces)
    for (const ConvexPiece& piece : surface.pieces)
      for (const Eigen::Vector3d& vertex : piece.vertices)
        largest = std::max(largest, vertex.lpNorm<Eigen::Infinity>());
  return largest * std::numeric_limits<float>::epsilon();
}

double distance_to_line(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d along = b - a;
  const double length = along.norm();
  return length > 0 ? along.cross(point - a).norm() / length : (point - a).norm();
}

/// Without the vertices that are nearer than `least` to the line between their neighbours. Of a convex ring
/// what is left is convex, and inside it.
Ring3 without_flat_corners(Ring3 ring, double least) {
  for (std::size_t i = 0, seen = 0; seen < ring.size() && ring.size() > 2;) {
    const std::size_t n = ring.size();
    i %= n;
    if (distance_to_line(ring[i], ring[(i + n - 1) % n], ring[(i + 1) % n]) < least) {
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
      i += n - 2;  // its neighbours have new neighbours: look at the one before again
      seen = 0;
    } else {
      ++i;
      ++seen;
    }
  }
  return ring;
}

/// Keeps vertices of different surfaces apart.
class VertexPlaces {
 public:
  explicit VertexPlaces(double gap) : gap_(gap) {}

  bool taken_by_another(SurfaceId surface, const Eigen::Vector3d& vertex) const {
    const Cell at = cell_of(vertex);
    for (int neighbour = 0; neighbour < 27; ++neighbour) {
      const Cell cell{at[0] + neighbour % 3 - 1, at[1] + neighbour / 3 % 3 - 1, at[2] + neighbour / 9 - 1};
      const auto [first, last] = places_.equal_range(cell);
      for (auto place = first; place != last; ++place)
        if (place->second.first != surface && (place->second.second - vertex).norm() < gap_) return true;
    }
    return false;
  }
  void take(SurfaceId surface, const Eigen::Vector3d& vertex) {
    places_.emplace(cell_of(vertex), std::make_pair(surface, vertex));
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell_of(const Eigen::Vector3d& vertex) const {
    const auto along = [&](double x) { return static_cast<std::int64_t>(std::floor(x / gap_)); };
    return {along(vertex.x()), along(vertex.y()), along(vertex.z())};
  }

  double gap_;
  std::multimap<Cell, std::pair<SurfaceId, Eigen::Vector3d>> places_;
};

Eigen::Vector3d as_float(const Eigen::Vector3d& vertex) { return vertex.cast<float>().cast<double>(); }

/// Moves vertices toward the piece's middle until no other surface's are near, and takes their places.
Ring3 at_places_of_its_own(SurfaceId surface, const Ring3& ring, double spacing, VertexPlaces& places) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : ring) middle += vertex / static_cast<double>(ring.size());
  // A step that rounding to floats does not undo; three of them leave any one other vertex behind.
  const double step = 8 * spacing + 1e-6;
  Ring3 apart;
  for (const Eigen::Vector3d& vertex : ring) {
    const Eigen::Vector3d inward = (middle - vertex).normalized();
    Eigen::Vector3d place = as_float(vertex);
    for (int steps = 1; places.taken_by_another(surface, place); ++steps)
      place = as_float(vertex + steps * step * inward);
    places.take(surface, place);
    apart.push_back(place);
  }
  return apart;
}

io::Shape fan(SurfaceId id, Ring3 ring) {
  io::Shape shape;
  shape.id = id;
  for (std::uint32_t i = 2; i < ring.size(); ++i) shape.mesh.triangles.push_back({0, i - 1, i});
  shape.mesh.vertices = std::move(ring);
  return shape;
}

bool is_surface_file(const std::string& name) {
  return name.starts_with("surface_") && name.ends_with(".stl");
}

}  // namespace

std::size_t export_hpp(const std::vector<PlannerSurface>& surfaces, const std::filesystem::path& folder,
                       bool force) {
  io::require_pieces(surfaces, folder);
  io::NewFolder output(folder, force, is_surface_file);
  const double spacing = float_spacing(surfaces);
  VertexPlaces places(1e-6);
  std::size_t written = 0;
  for (const PlannerSurface& surface : surfaces) {
    std::size_t number = 0;
    for (const ConvexPiece& piece : surface.pieces) {
      // Rounding lifts a vertex by up to `spacing`: over a hundred times that, it tilts by half a degree.
      const Ring3 ring = without_flat_corners(piece.vertices, 100 * spacing);
      if (ring.size() < 3) continue;
      io::NewFile file(output.temporary() / ("surface_" + std::to_string(surface.id) + "_" +
                                             std::to_string(++number) + ".stl"),
                       false, io::NewFile::LeftOvers::leave);
      const io::Shape shape = fan(surface.id, at_places_of_its_own(surface.id, ring, spacing, places));
      file.write([&](std::ostream& out) { io::write_stl(shape, out); });
      file.commit();
    }
    written += number;
  }
  output.commit();
  return written;
}

}  // namespace octosurf
