#include "evaluation/evaluate.hpp"
#include "hand_made.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <gtest/gtest.h>

namespace octosurf::evaluation {
namespace {

using namespace hand_made;

/// Faces and, near them, surfaces that miss them by a little in every way.
World random_world(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  World world;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Isometry3d T = random_motion(random, 0.8);
    world.add_face(T, {polygon(box(0, 0, 0.3 + unit(random), 0.3 + unit(random)))}).gone = i == 5;
    for (int k = 0; k < 2; ++k) {
      const double u = 0.4 * unit(random), v = 0.4 * unit(random);
      const Eigen::Isometry3d tilt = frame({0, 0, 0.06 * unit(random) - 0.03}, radians(20 * unit(random)),
                                           {unit(random), unit(random), 0.1});
      world.add_surface(T * tilt, {polygon(box(u, v, u + 0.2 + unit(random), v + 0.2 + unit(random)))});
    }
  }
  return world;
}

double angle_between(const Plane& a, const Plane& b) {
  return std::acos(std::min(1.0, a.normal.dot(b.normal)));
}

bool touches(const Eigen::Vector3d& p, const Plane& plane, const Eigen::Isometry3d& T,
             const std::vector<Polygon>& polygons, double margin) {
  const Eigen::Vector2d uv = (T.inverse() * p).head<2>();
  return std::abs(plane.signed_distance(p)) <= 0.03 &&
         (is_inside(polygons, uv) || distance_to_rings(polygons, uv) <= margin);
}

/// Of a point of a surface to the nearest face under it, in the face's plane: 0 within its outline.
double outline_distance(const World& world, const Plane& plane, const Eigen::Vector3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const TrueFace& face : world.truth.faces) {
    if (face.gone || angle_between(plane, face.plane) > radians(30) ||
        std::abs(face.plane.signed_distance(p)) > 0.03)
      continue;
    const Eigen::Vector2d uv = (face.T_map_face.inverse() * p).head<2>();
    nearest = std::min(nearest, is_inside(face.polygons, uv) ? 0 : distance_to_rings(face.polygons, uv));
  }
  return nearest;
}

TEST(EvaluateProperties, AgreesWithBruteForceOnRandomWorlds) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 random(seed);
  double ghosts = 0;
  for (int round = 0; round < 3; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
    const World world = random_world(random);
    double cells = 0, covered = 0, layers = 0, samples = 0, unsafe = 0, ghost = 0;
    double off_10mm = 0, off_15mm = 0, off_50mm = 0;
    for (const TrueFace& face : world.truth.faces) {
      for (const CellRun& run : face.visible) {
        for (int c = run.column; !face.gone && c < run.column + run.count; ++c) {
          const Eigen::Vector3d p =
              face.T_map_face * Eigen::Vector3d((c + 0.5) / 100, (run.row + 0.5) / 100, 0);
          int n = 0;
          for (const SurfacePtr& s : world.snapshot.surfaces) {
            n += angle_between(s->plane, face.plane) <= radians(15) &&
                 touches(p, s->plane, s->T_map_surface, s->polygons, 0.01);
          }
          ++cells;
          covered += n > 0;
          layers += n;
        }
      }
    }
    for (const SurfacePtr& s : world.snapshot.surfaces) {
      for (const CellRun& run : cells_inside(s->polygons, 0.01)) {
        for (int c = run.column; c < run.column + run.count; ++c) {
          const Eigen::Vector3d p =
              s->T_map_surface * Eigen::Vector3d((c + 0.5) / 100, (run.row + 0.5) / 100, 0);
          bool safe = false, was = false;
          for (const TrueFace& face : world.truth.faces) {
            if (angle_between(s->plane, face.plane) > radians(30)) continue;
            if (touches(p, face.plane, face.T_map_face, face.polygons, 0.02)) (face.gone ? was : safe) = true;
          }
          ++samples;
          unsafe += !safe;
          ghost += !safe && was;
          const double off = outline_distance(world, s->plane, p);
          off_10mm += off > 0.01;
          off_15mm += off > 0.015;
          off_50mm += off > 0.05;
        }
      }
    }
    const Evaluation scores = scores_of(world);
    EXPECT_NEAR(scores.coverage, covered / cells, 1e-9);
    EXPECT_NEAR(scores.multiplicity, layers / covered, 1e-9);
    EXPECT_NEAR(scores.area_m2, samples / 1e4, 1e-9);
    EXPECT_NEAR(scores.unsafe_m2, unsafe / 1e4, 1e-9);
    EXPECT_NEAR(scores.ghost_m2, ghost / 1e4, 1e-9);
    EXPECT_NEAR(scores.unsafe_at(0), off_10mm / 1e4, 1e-9);
    EXPECT_NEAR(scores.unsafe_at(1), off_15mm / 1e4, 1e-9);
    EXPECT_NEAR(scores.false_m2, off_50mm / 1e4, 1e-9);
    EXPECT_GT(off_10mm, off_15mm);
    EXPECT_GT(off_15mm, off_50mm);
    EXPECT_GT(off_50mm, 0);
    EXPECT_LT(covered, cells);
    ghosts += ghost;
  }
  EXPECT_GT(ghosts, 0);  // in one world of a hundred both surfaces miss the face that is gone
}

TEST(EvaluateProperties, ARigidMotionOfEverythingChangesNothing) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 random(seed);
  for (int round = 0; round < 4; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
    const World world = random_world(random);
    const Evaluation before = scores_of(world);
    const Evaluation after = scores_of(world.moved(random_motion(random, 50)));
    EXPECT_EQ(after.correct, before.correct);
    EXPECT_EQ(after.over_segmented, before.over_segmented);
    EXPECT_EQ(after.under_segmented, before.under_segmented);
    EXPECT_EQ(after.missed, before.missed);
    EXPECT_EQ(after.noise, before.noise);
    // A sample that lies on a limit may fall to its other side by rounding.
    EXPECT_NEAR(after.coverage, before.coverage, 1e-3);
    EXPECT_NEAR(after.multiplicity, before.multiplicity, 1e-3);
    EXPECT_NEAR(after.unsafe_m2, before.unsafe_m2, 1e-3);
    EXPECT_NEAR(after.ghost_m2, before.ghost_m2, 1e-3);
    for (std::size_t m = 0; m < outline_margins.size(); ++m)
      EXPECT_NEAR(after.unsafe_at(m), before.unsafe_at(m), 1e-3);
    EXPECT_NEAR(after.false_m2, before.false_m2, 1e-3);
    EXPECT_NEAR(after.normal_rad.mean, before.normal_rad.mean, 1e-9);
    EXPECT_NEAR(after.offset_m.max, before.offset_m.max, 1e-9);
    EXPECT_NEAR(after.boundary_m.mean, before.boundary_m.mean, 1e-6);
  }
}

TEST(EvaluateProperties, TheOrderOfFacesAndSurfacesDoesNotMatter) {
  std::mt19937_64 random = test::rng();
  World world = random_world(random);
  const Evaluation before = scores_of(world);
  std::reverse(world.truth.faces.begin(), world.truth.faces.end());
  std::reverse(world.snapshot.surfaces.begin(), world.snapshot.surfaces.end());
  const Evaluation after = scores_of(world);
  EXPECT_EQ(after.correct, before.correct);
  EXPECT_EQ(after.noise, before.noise);
  EXPECT_DOUBLE_EQ(after.coverage, before.coverage);
  EXPECT_DOUBLE_EQ(after.unsafe_share, before.unsafe_share);
}

/// An outline of 4 cm teeth around a box with many square holes, as alpha shapes have.
std::vector<Polygon> toothed(double width, double height) {
  Ring2 outer;
  const Ring2 corners = box(0, 0, width, height);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d a = corners[i], edge = corners[(i + 1) % 4] - a;
    const int teeth = static_cast<int>(edge.norm() / 0.04);
    const Eigen::Vector2d inward = Eigen::Vector2d(-edge.y(), edge.x()).normalized() * 0.01;
    for (int k = 0; k < teeth; ++k) outer.emplace_back(a + edge * k / teeth + (k % 2 ? inward : 0 * inward));
  }
  Polygon result{outer, {}};
  for (double u = 0.3; u < width - 0.3; u += 0.5) {
    for (double v = 0.3; v < height - 0.3; v += 0.5) {
      Ring2 hole = box(u, v, u + 0.1, v + 0.1);
      std::reverse(hole.begin(), hole.end());
      result.holes.push_back(hole);
    }
  }
  return {result};
}

TEST(EvaluateProperties, AHouseOf150SquareMetresIsFoundWhole) {
  World world;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Isometry3d T = frame({6.0 * (i % 3), 5.0 * (i / 3), 0.3 * i}, radians(10 * i));
    TrueFace& face = world.add_face(T, {polygon(box(0, 0, 0.01, 0.01))});
    face.polygons = {polygon(box(0, 0, 5, 3))};
    face.visible.clear();
    for (int row = 0; row < 300; ++row) face.visible.push_back({row, 0, 500});
    world.add_surface(T, toothed(5, 3));
  }
  EXPECT_EQ(scores_of(world).correct, 10u);
}

}  // namespace
}  // namespace octosurf::evaluation
