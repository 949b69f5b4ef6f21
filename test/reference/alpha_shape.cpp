#include "reference/alpha_shape.hpp"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace octosurf::reference {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using FaceBase = CGAL::Triangulation_face_base_with_info_2<int, Kernel>;
using Delaunay =
    CGAL::Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>>;

constexpr int dropped = -1;
constexpr int unlabelled = -2;

/// An edge with exactly one triangle, which lies to its left.
struct BoundaryEdge {
  std::uint32_t from = 0, to = 0;
  int piece = 0;
};

void drop_long_triangles(Delaunay& triangulation, double max_side) {
  for (auto face : triangulation.all_face_handles()) {
    bool keep = !triangulation.is_infinite(face);
    for (int i = 0; keep && i < 3; ++i)
      keep = triangulation.segment(face, i).squared_length() <= max_side * max_side;
    face->info() = keep ? unlabelled : dropped;
  }
}

/// Numbers the pieces that are connected through edges; returns how many there are.
int label_pieces(Delaunay& triangulation) {
  int pieces = 0;
  std::vector<Delaunay::Face_handle> stack;
  for (auto seed : triangulation.finite_face_handles()) {
    if (seed->info() != unlabelled) continue;
    seed->info() = pieces;
    stack.push_back(seed);
    while (!stack.empty()) {
      const auto face = stack.back();
      stack.pop_back();
      for (int i = 0; i < 3; ++i) {
        const auto neighbor = face->neighbor(i);
        if (neighbor->info() != unlabelled) continue;
        neighbor->info() = pieces;
        stack.push_back(neighbor);
      }
    }
    ++pieces;
  }
  return pieces;
}

std::vector<BoundaryEdge> boundary_edges(const Delaunay& triangulation) {
  std::vector<BoundaryEdge> edges;
  for (auto face : triangulation.finite_face_handles()) {
    if (face->info() == dropped) continue;
    for (int i = 0; i < 3; ++i)
      if (face->neighbor(i)->info() == dropped)
        edges.push_back(
            {face->vertex(Delaunay::ccw(i))->info(), face->vertex(Delaunay::cw(i))->info(), face->info()});
  }
  return edges;
}

double angle_of(const Eigen::Vector2d& direction) { return std::atan2(direction.y(), direction.x()); }

/// Chains boundary edges into simple rings.
class RingWalk {
 public:
  RingWalk(const std::vector<Eigen::Vector2d>& points, const std::vector<BoundaryEdge>& edges)
      : points_(points), edges_(edges), used_(edges.size(), false) {
    for (std::size_t i = 0; i < edges.size(); ++i) outgoing_[edges[i].from].push_back(i);
  }

  /// Calls `emit(ring, piece)` for every ring. A walk that comes back to a vertex has closed a ring
  /// of its own there, which is cut off: rings that touch in a vertex stay simple.
  template <typename Emit>
  void walk_all(Emit emit) {
    for (std::size_t first = 0; first < edges_.size(); ++first) {
      if (used_[first]) continue;
      std::vector<std::uint32_t> path{edges_[first].from};
      std::map<std::uint32_t, std::size_t> place{{edges_[first].from, 0}};
      for (std::size_t edge = first;; edge = next(edge)) {
        used_[edge] = true;
        const std::uint32_t vertex = edges_[edge].to;
        if (const auto seen = place.find(vertex); seen != place.end()) {
          const std::size_t start = seen->second;
          Ring2 ring;
          for (std::size_t i = start; i < path.size(); ++i) ring.push_back(points_[path[i]]);
          for (std::size_t i = start + 1; i < path.size(); ++i) place.erase(path[i]);
          path.resize(start + 1);
          emit(std::move(ring), edges_[edge].piece);
          if (start == 0) break;
        } else {
          place[vertex] = path.size();
          path.push_back(vertex);
        }
      }
    }
  }

 private:
  /// The unused outgoing edge that follows first when turning clockwise from where we came: both
  /// edges bound the same fan of triangles, so a ring never changes its piece.
  std::size_t next(std::size_t edge) const {
    const auto& [from, at, piece] = edges_[edge];
    const double back = angle_of(points_[from] - points_[at]);
    std::size_t best = edges_.size();
    double best_turn = 0;
    for (const std::size_t candidate : outgoing_.at(at)) {
      if (used_[candidate]) continue;
      double turn = back - angle_of(points_[edges_[candidate].to] - points_[at]);
      if (turn <= 0) turn += 2 * std::numbers::pi;
      if (best == edges_.size() || turn < best_turn) {
        best = candidate;
        best_turn = turn;
      }
    }
    return best;
  }

  const std::vector<Eigen::Vector2d>& points_;
  const std::vector<BoundaryEdge>& edges_;
  std::vector<bool> used_;
  std::map<std::uint32_t, std::vector<std::size_t>> outgoing_;
};

}  // namespace

double signed_area(const Ring2& ring) {
  double twice = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const auto& a = ring[i];
    const auto& b = ring[(i + 1) % ring.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

AlphaShape alpha_shape(const std::vector<Eigen::Vector2d>& points, double max_side) {
  std::vector<std::pair<Kernel::Point_2, std::uint32_t>> sites;
  sites.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    sites.emplace_back(Kernel::Point_2(points[i].x(), points[i].y()), static_cast<std::uint32_t>(i));
  Delaunay triangulation(sites.begin(), sites.end());
  AlphaShape shape;
  if (triangulation.dimension() < 2) return shape;

  drop_long_triangles(triangulation, max_side);
  shape.polygons.resize(static_cast<std::size_t>(label_pieces(triangulation)));
  const std::vector<BoundaryEdge> edges = boundary_edges(triangulation);
  RingWalk(points, edges).walk_all([&shape](Ring2 ring, int piece) {
    const double area = signed_area(ring);
    Polygon& polygon = shape.polygons[static_cast<std::size_t>(piece)];
    shape.area_m2 += area;
    if (area > 0)
      polygon.outer = std::move(ring);
    else
      polygon.holes.push_back(std::move(ring));
  });
  for (const BoundaryEdge& edge : edges) shape.boundary.push_back(edge.from);
  std::sort(shape.boundary.begin(), shape.boundary.end());
  shape.boundary.erase(std::unique(shape.boundary.begin(), shape.boundary.end()), shape.boundary.end());
  return shape;
}

OddEven::OddEven(const std::vector<Polygon>& polygons, double row_height) : row_height_(row_height) {
  std::vector<Edge> edges;
  const auto collect = [&edges](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) edges.push_back({ring[i], ring[(i + 1) % ring.size()]});
  };
  for (const Polygon& polygon : polygons) {
    collect(polygon.outer);
    for (const Ring2& hole : polygon.holes) collect(hole);
  }
  if (edges.empty()) return;
  lowest_ = edges.front().from.y();
  double highest = lowest_;
  for (const Edge& edge : edges) {
    lowest_ = std::min(lowest_, edge.from.y());
    highest = std::max(highest, edge.from.y());
  }
  const auto row_of = [this](double v) {
    return static_cast<std::size_t>(std::floor((v - lowest_) / row_height_));
  };
  rows_.resize(row_of(highest) + 1);
  for (const Edge& edge : edges) {
    const auto [low, high] = std::minmax(edge.from.y(), edge.to.y());
    for (std::size_t row = row_of(low); row <= row_of(high); ++row) rows_[row].push_back(edge);
  }
}

bool OddEven::contains(const Eigen::Vector2d& point) const {
  const double row = std::floor((point.y() - lowest_) / row_height_);
  if (!(row >= 0) || row >= static_cast<double>(rows_.size())) return false;
  bool inside = false;
  for (const auto& [a, b] : rows_[static_cast<std::size_t>(row)]) {
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    const double crossing = a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (point.x() < crossing) inside = !inside;
  }
  return inside;
}

}  // namespace octosurf::reference
