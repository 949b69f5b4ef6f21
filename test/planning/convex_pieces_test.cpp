// Convex pieces of outlines and contact regions: inside, disjoint, exactly; and how much they cover.
#include "planning/exact_region.hpp"
#include "shapes.hpp"
#include "support/paths.hpp"
#include "support/polygons.hpp"

#include <octosurf/contact.hpp>
#include <octosurf/map.hpp>
#include <octosurf/pieces.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;

std::vector<Ring2> rings_of(const Surface& on, const std::vector<ConvexPiece>& pieces) {
  std::vector<Ring2> rings;
  for (const ConvexPiece& piece : pieces) {
    rings.emplace_back();
    for (const Eigen::Vector3d& vertex : piece.vertices) rings.back().push_back(to_uv(on, vertex));
  }
  return rings;
}

double width_of(const Ring2& ring) {
  double width = HUGE_VAL;
  for (int i = 0; i < 3600; ++i) {
    const double angle = std::numbers::pi * i / 3600;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const Eigen::Vector2d& p : ring) {
      const double along = p.dot(Eigen::Vector2d(std::cos(angle), std::sin(angle)));
      low = std::min(low, along);
      high = std::max(high, along);
    }
    width = std::min(width, high - low);
  }
  return width;
}

/// Pieces as pieces.hpp promises them; the share of the polygons that they cover.
double expect_valid(const Surface& on, const std::vector<Polygon>& polygons, std::size_t most,
                    double min_area_m2 = 0) {
  const std::vector<ConvexPiece> pieces = convex_pieces(on, polygons, most, min_area_m2);
  const std::vector<Ring2> rings = rings_of(on, pieces);
  EXPECT_LE(pieces.size(), most);
  EXPECT_TRUE(test::disjoint(rings));
  EXPECT_TRUE(test::inside_of(rings, polygons));
  double sum = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const double area = ring_area(rings[i]);
    sum += area;
    EXPECT_GE(area, min_area_m2);
    if (i > 0) {
      EXPECT_LE(area, ring_area(rings[0]));
      EXPECT_GE(width_of(rings[i]), on.resolution / 4);
    }
    const auto n = static_cast<Eigen::Index>(rings[i].size());
    EXPECT_EQ(pieces[i].A.rows(), n);
    EXPECT_EQ(pieces[i].b.size(), n);
    for (std::size_t k = 0; k < rings[i].size(); ++k) {
      const Eigen::Vector2d in = rings[i][(k + 1) % rings[i].size()] - rings[i][k];
      const Eigen::Vector2d out = rings[i][(k + 2) % rings[i].size()] - rings[i][(k + 1) % rings[i].size()];
      EXPECT_GT(in.x() * out.y() - in.y() * out.x(), 0);
      const auto row = static_cast<Eigen::Index>(k);
      EXPECT_NEAR(pieces[i].A.row(row).norm(), 1, 1e-12);
      const auto slack = [&](std::size_t corner) {
        return pieces[i].b[row] - pieces[i].A.row(row).dot(rings[i][corner % rings[i].size()]);
      };
      for (std::size_t corner = 0; corner < rings[i].size(); ++corner) EXPECT_GE(slack(corner), -1e-12);
      EXPECT_LT(slack(k) + slack(k + 1), 1e-9);  // the row is this edge
      EXPECT_NEAR(on.plane.signed_distance(pieces[i].vertices[k]), 0, 1e-12);
    }
  }
  const double area = test::area(polygons);
  return area > 0 ? sum / area : 1;
}

Surface with_voxels(Surface surface) {
  surface.resolution = 0.02;
  return surface;
}

TEST(ConvexPieces, OfAConvexRegionIsOne) {
  const Surface on = with_voxels(surface(1, {{box(0, 0, 2, 1), {}}}, pose({1, 2, 0}, 0.3, {1, 1, 1})));
  const ContactRegion region = contact_region(on, ContactShape::rectangle(0.2, 0.1), 0.7);
  EXPECT_EQ(convex_pieces(on, region.polygons).size(), 1u);
  EXPECT_GT(expect_valid(on, region.polygons, 12), 0.999);
}

TEST(ConvexPieces, OfSimpleShapesAreFewAndLoseLittle) {
  const Surface on = with_voxels(surface(1, {{box(0, 0, 3, 3), {}}}));
  const Polygon pinched{box(0, 0, 4, 4),
                        {reversed({{0, 0}, {2, 1}, {2, 2}, {1, 2}}), reversed({{2, 2}, {3, 2}, {3, 3}})}};
  const std::vector<Polygon> corner{{{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}, {}}};
  struct Case {
    const char* name;
    std::vector<Polygon> polygons;
    std::size_t most;
    double share;
  };
  for (const auto& [name, polygons, most, share] :
       {Case{"convex, with a straight vertex", {{{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {0, 1}}, {}}}, 1, 0.999},
        Case{"an L", corner, 2, 0.999},
        Case{"a frame", {{box(0, 0, 3, 3), {reversed(box(1, 1, 1, 1))}}}, 5, 0.99},
        Case{"rings that touch in a vertex", {pinched, {{{4, 4}, {5, 4}, {5, 5}}, {}}}, 20, 0.95},
        Case{"a thin one", {{box(0, 0, 1, 0.001), {}}}, 3, 0.9}}) {
    SCOPED_TRACE(name);
    const std::vector<ConvexPiece> pieces = convex_pieces(on, polygons, 20);
    EXPECT_LE(pieces.size(), most);
    if (most == 1) {
      EXPECT_EQ(pieces.at(0).vertices.size(), 4u);
    }
    EXPECT_GT(expect_valid(on, polygons, 20), share);
  }
  EXPECT_NEAR(expect_valid(on, corner, 1), 2.0 / 3, 0.01);
}

TEST(ConvexPieces, NothingFromNothingAndWhatIsNotFiniteIsRefused) {
  const Surface on = with_voxels(surface(1, {{box(0, 0, 1, 1), {}}}));
  EXPECT_TRUE(convex_pieces(on, {}).empty());
  EXPECT_TRUE(convex_pieces(on, on.polygons, 0).empty());
  EXPECT_TRUE(convex_pieces(on, on.polygons, 3, 1.1).empty());
  EXPECT_TRUE(convex_pieces(on, {{{{0, 0}, {1, 1}, {2, 2}}, {}}}).empty());
  for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(convex_pieces({}, {{{{0, 0}, {1, 0}, {bad, 1}}, {}}}), Error);
}

TEST(ConvexPieces, OfRandomPolygons) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 15 && !HasFailure(); ++i) {
    const Surface on = with_voxels(surface(1, {random_polygon(random), {box(3, 0, 0.4, 0.2), {}}},
                                           pose({1, -2, 0.5}, 0.1 * i, {3, -5, 1})));
    const ContactRegion region =
        contact_region(on, ContactShape::rectangle(0.2, 0.1), 0.4 * i, {.up = on.plane.normal});
    expect_valid(on, region.polygons, 1 + random() % 12, i % 2 == 0 ? 0 : 0.01);
    expect_valid(on, on.polygons, 1 + random() % 40);
  }
}

TEST(ConvexPieces, CoverTheSavedOfficeAsStated) {
  const std::shared_ptr<const Snapshot> office =
      load_map(test::paths::source() + "/maps/office").map.snapshot();
  double covered = 0, all = 0;
  for (const SurfacePtr& on : office->surfaces) {
    double sum = 0;
    for (const Ring2& ring : rings_of(*on, convex_pieces(*on, on->polygons))) sum += ring_area(ring);
    const double area = test::area(on->polygons);
    EXPECT_GT(sum, 0.845 * area) << on->id;
    covered += sum;
    all += area;
  }
  EXPECT_GT(covered, 0.975 * all);
}

TEST(ConvexPieces, StayWhereThePolygonStays) {
  std::mt19937_64 random(test::seed());
  const Surface on = with_voxels(surface(1, {{box(0, 0, 1, 1), {}}}));
  Polygon here = random_polygon(random), there = random_polygon(random);
  for (Eigen::Vector2d& p : there.outer) p.x() += 10;
  for (Ring2& hole : there.holes)
    for (Eigen::Vector2d& p : hole) p.x() += 10;
  const std::vector<Ring2> before = rings_of(on, convex_pieces(on, {here, there}, 200, 0.02));
  here.outer[3] *= 0.9;
  const std::vector<Ring2> after = rings_of(on, convex_pieces(on, {here, there}, 200, 0.02));
  std::size_t far = 0;
  for (const Ring2& ring : before)
    if (ring[0].x() > 5) {
      ++far;
      EXPECT_THAT(after, testing::Contains(ring));
    }
  EXPECT_GT(far, 2u);
}

}  // namespace
}  // namespace octosurf::planning
