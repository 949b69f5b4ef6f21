#include "shapes.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>

#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;

Ring2 ring_of(const Surface& on, const ConvexPiece& piece) {
  Ring2 ring;
  for (const Eigen::Vector3d& vertex : piece.vertices) ring.push_back(to_uv(on, vertex));
  return ring;
}

// Sutherland and Hodgman: what of `ring` satisfies A·x ≤ b.
Ring2 clipped(Ring2 ring, const ConvexPiece& by) {
  for (Eigen::Index row = 0; row < by.b.size(); ++row) {
    const auto outside = [&](const Eigen::Vector2d& p) { return by.A.row(row).dot(p) - by.b[row]; };
    Ring2 kept;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &p = ring[i], &q = ring[(i + 1) % ring.size()];
      const double dp = outside(p), dq = outside(q);
      if (dp <= 0) kept.push_back(p);
      if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) kept.push_back(p + dp / (dp - dq) * (q - p));
    }
    ring = std::move(kept);
  }
  return ring;
}

// Guarantees 1 and 2 of the header. Pieces that cover the polygon's area, do not overlap and whose
// vertices and edge midpoints lie inside or on the edges, cover the polygon.
void expect_valid(const Surface& on) {
  const std::vector<ConvexPiece> pieces = convex_pieces(on);
  double sum = 0;
  for (const ConvexPiece& piece : pieces) {
    const Ring2 ring = ring_of(on, piece);
    const auto n = static_cast<Eigen::Index>(ring.size());
    ASSERT_GE(n, 3);
    ASSERT_EQ(piece.A.rows(), n);
    ASSERT_EQ(piece.b.size(), n);
    EXPECT_GT(ring_area(ring), 0);  // counter-clockwise
    sum += ring_area(ring);
    for (Eigen::Index i = 0; i < n; ++i) {
      EXPECT_NEAR(piece.A.row(i).norm(), 1, 1e-12);
      int tight = 0;
      for (const Eigen::Vector2d& corner : ring) {
        const double slack = piece.b[i] - piece.A.row(i).dot(corner);
        EXPECT_GE(slack, -1e-12);
        if (slack < 1e-9) ++tight;
      }
      EXPECT_GE(tight, 2);  // every row is an edge
    }
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d middle = (ring[i] + ring[(i + 1) % ring.size()]) / 2;
      for (const Eigen::Vector2d& p : {ring[i], middle}) {
        bool within = false;
        for (const Polygon& polygon : on.polygons) {
          within = within || inside(polygon, p) || edge_distance(polygon, p) < 1e-9;
        }
        EXPECT_TRUE(within);
      }
    }
    for (const Eigen::Vector3d& v : piece.vertices) EXPECT_NEAR(on.plane.signed_distance(v), 0, 1e-12);
  }
  EXPECT_NEAR(sum, on.area_m2, 1e-10);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_NEAR(ring_area(clipped(ring_of(on, pieces[i]), pieces[j])), 0, 1e-10);
    }
  }
}

TEST(ConvexPieces, ConvexPolygonIsOnePieceWithoutItsStraightVertices) {
  const Surface on = surface(1, {{{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {0, 1}}, {}}});
  ASSERT_EQ(convex_pieces(on).size(), 1u);
  EXPECT_EQ(convex_pieces(on)[0].vertices.size(), 4u);
  expect_valid(on);
}

TEST(ConvexPieces, LShapeIsTwo) {
  const Surface on = surface(1, {{{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}, {}}});
  EXPECT_EQ(convex_pieces(on).size(), 2u);
  expect_valid(on);
}

TEST(ConvexPieces, FrameIsAtMostFourTimesFour) {
  const Surface on =
      surface(1, {{box(0, 0, 3, 3), {reversed(box(1, 1, 1, 1))}}}, pose({1, 2, 3}, 1.1, {4, -2, 1}));
  EXPECT_GE(convex_pieces(on).size(), 4u);
  EXPECT_LE(convex_pieces(on).size(), 16u);
  expect_valid(on);
}

TEST(ConvexPieces, RingsTouchingInAVertexAndIslands) {
  const Polygon pinched{box(0, 0, 4, 4),
                        {reversed({{0, 0}, {2, 1}, {2, 2}, {1, 2}}), reversed({{2, 2}, {3, 2}, {3, 3}})}};
  expect_valid(surface(1, {pinched, {{{4, 4}, {5, 4}, {5, 5}}, {}}}));
}

TEST(ConvexPieces, NothingFromNothing) {
  EXPECT_TRUE(convex_pieces(Surface{}).empty());
  EXPECT_THROW(convex_pieces(surface(1, {{{{0, 0}, {1, 1}, {2, 2}}, {}}})), Error);  // that is no ring
}

TEST(ConvexPieces, RefusesNotFinite) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_THROW(convex_pieces(surface(1, {{{{0, 0}, {1, 0}, {infinity, 1}}, {}}})), Error);
}

TEST(ConvexPieces, RandomPolygonsWithHoles) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 60 && !HasFailure(); ++i) {
    expect_valid(surface(1, {random_polygon(random)}, pose({1, -2, 0.5}, 0.1 * i, {3, -5, 1.5})));
  }
}

}  // namespace
}  // namespace octosurf::planning
