#include "geometry/disjoint_sets.hpp"
#include "geometry/orientation.hpp"
#include "geometry/triangulate.hpp"
#include "planning/convex_piece.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>

#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

using Piece = std::vector<std::uint32_t>;  // vertices, counter-clockwise; empty once merged away

// Hertel and Mehlhorn: merges triangles over every diagonal that no reflex vertex needs.
class ConvexMerge {
 public:
  explicit ConvexMerge(const Polygon& polygon) {
    const auto triangles = geometry::triangulate(polygon, points_);
    for (const auto& t : triangles) {
      const auto piece = static_cast<std::uint32_t>(pieces_.size());
      pieces_.emplace_back(t.begin(), t.end());
      owners_.add();
      for (std::size_t i = 0; i < 3; ++i) piece_at_[{t[i], t[(i + 1) % 3]}] = piece;
    }
    for (const auto& [from, to] : diagonals()) try_merge(from, to);
  }

  const std::vector<Eigen::Vector2d>& points() const { return points_; }
  const std::vector<Piece>& pieces() const { return pieces_; }

  // Exactly left (1), straight (0) or right (-1) at b.
  int turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return geometry::orientation(points_[a], points_[b], points_[c]);
  }

 private:
  using Edge = std::pair<std::uint32_t, std::uint32_t>;

  // Least useful first; the remaining ones are few and halve the reflex angles.
  std::vector<Edge> diagonals() const {
    std::vector<std::pair<double, Edge>> ranked;
    for (const auto& [edge, piece] : piece_at_) {
      const Edge back{edge.second, edge.first};
      if (edge.first > edge.second || piece_at_.count(back) == 0) continue;
      ranked.emplace_back(std::max(usefulness(edge), usefulness(back)), edge);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<Edge> edges;
    edges.reserve(ranked.size());
    for (const auto& [rank, edge] : ranked) edges.push_back(edge);
    return edges;
  }

  // The smaller of the two angles into which a diagonal cuts the corner at its start; 0 if that corner is
  // convex. Computed before merging.
  double usefulness(const Edge& diagonal) const {
    const double left = wedge(diagonal, true), right = wedge(diagonal, false);
    return left + right > std::numbers::pi ? std::min(left, right) : 0;
  }

  // The angle from a diagonal around its start to the next ring edge, over the triangles between.
  double wedge(Edge edge, bool to_left) const {
    double angle = 0;
    for (;;) {
      const auto at = piece_at_.find(to_left ? edge : Edge{edge.second, edge.first});
      if (at == piece_at_.end()) return angle;
      const Piece& t = pieces_[at->second];
      const std::uint32_t apex = t[0] ^ t[1] ^ t[2] ^ edge.first ^ edge.second;
      const Eigen::Vector2d a = points_[edge.second] - points_[edge.first];
      const Eigen::Vector2d b = points_[apex] - points_[edge.first];
      angle += std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
      edge.second = apex;
    }
  }

  // The vertices of `piece` in order, from the end of edge from → to around to its beginning.
  static Piece opened(const Piece& piece, std::uint32_t from) {
    const auto begin = std::find(piece.begin(), piece.end(), from);
    Piece result(begin + 1, piece.end());
    result.insert(result.end(), piece.begin(), begin + 1);
    return result;
  }

  void try_merge(std::uint32_t from, std::uint32_t to) {
    const std::size_t left = owners_.root(piece_at_.at({from, to})),
                      right = owners_.root(piece_at_.at({to, from}));
    const Piece p = opened(pieces_[left], from);  // to … from
    const Piece q = opened(pieces_[right], to);   // from … to
    if (turn(p[p.size() - 2], from, q[1]) < 0 || turn(q[q.size() - 2], to, p[1]) < 0) return;
    Piece merged(p.begin(), p.end() - 1);
    merged.insert(merged.end(), q.begin(), q.end() - 1);
    pieces_[left] = std::move(merged);
    pieces_[right].clear();
    owners_.join(left, right);
  }

  std::vector<Eigen::Vector2d> points_;
  std::vector<Piece> pieces_;
  geometry::DisjointSets owners_;           // merged pieces; the root has their vertices
  std::map<Edge, std::uint32_t> piece_at_;  // the triangle left of a directed edge
};

}  // namespace

std::vector<ConvexPiece> convex_pieces(const Surface& surface) {
  std::vector<ConvexPiece> result;
  for (const Polygon& polygon : simplified(surface)) {
    const ConvexMerge merge(polygon);
    for (const Piece& piece : merge.pieces()) {
      std::vector<Eigen::Vector2d> corners;  // without vertices on straight edges
      for (std::size_t i = 0; i < piece.size(); ++i) {
        const std::uint32_t before = piece[(i + piece.size() - 1) % piece.size()];
        if (merge.turn(before, piece[i], piece[(i + 1) % piece.size()]) > 0) {
          corners.push_back(merge.points()[piece[i]]);
        }
      }
      if (!corners.empty()) result.push_back(planning::convex_piece(surface, corners));
    }
  }
  return result;
}

}  // namespace octosurf
