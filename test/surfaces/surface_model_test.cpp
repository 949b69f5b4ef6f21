#include <algorithm>
// The working form of a surface against what its inliers say when asked one by one.
#include "support/polygons.hpp"
#include "support/seed.hpp"
#include "surfaces/blobs.hpp"
#include "surfaces/surface_model.hpp"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>

namespace octosurf::surfaces {
namespace {

using test::d;
using test::h;
using test::model_of;

TEST(SurfaceModel, PolygonsAreTheAlphaShapeOfAllInliers) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::size_t points = 0, used = 0;
  for (int round = 0; round < 30 && !HasFailure(); ++round) {
    Eigen::Isometry3d pose = test::random_pose(rng);
    if (round % 2 == 0)
      pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round / 2 % 3));  // along the voxels: dense
    const double hole = round % 3 == 0 ? 0.03 : round % 3 == 1 ? 0.08 : 0.2;
    SurfaceModel model =
        model_of(test::voxels_of(test::random_blob(rng, 0.8, hole), pose, d, 0.8, 0.006, rng), pose);
    model.derive(h);
    const std::vector<Polygon> slow = test::slow_polygons(model, h);
    EXPECT_EQ(test::ring_sets(model.polygons()), test::ring_sets(slow)) << "round " << round;
    EXPECT_LT(test::difference(model.polygons(), slow), 1e-9);
    if (round % 2 == 1) continue;
    points += model.size();
    used += model.outline_sites();
  }
  EXPECT_LT(used, points * 9 / 10) << "nothing was left out: the test tests nothing";
}

TEST(SurfaceModel, SmallHoleSizesUseEveryPoint) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  for (const double small : {1.5 * d, 2.5 * d, 3.9 * d}) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    SurfaceModel model =
        model_of(test::voxels_of(test::random_blob(rng, 0.4, 0.1), pose, d, 0.4, 0.006, rng), pose);
    model.derive(small);
    EXPECT_EQ(test::ring_sets(model.polygons()), test::ring_sets(test::slow_polygons(model, small)));
  }
}

/// The larger the holes that are closed, the fewer sites stand in for what lies deep inside.
TEST(SurfaceModel, LargeHoleSizesNeedFewSites) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  for (int round = 0; round < 12 && !HasFailure(); ++round) {
    const double large = std::array{5 * d, 8 * d, 10 * d, 17 * d}[static_cast<std::size_t>(round % 4)];
    Eigen::Isometry3d pose = test::random_pose(rng);
    pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round % 3));
    test::Blob blob = test::random_blob(rng, 1.5, round % 2 == 0 ? 0.1 : 0.3);
    SurfaceModel model = model_of(test::voxels_of(blob, pose, d, 1.5, 0.006, rng), pose);
    model.derive(large);
    const std::vector<Polygon> slow = test::slow_polygons(model, large);
    EXPECT_EQ(test::ring_sets(model.polygons()), test::ring_sets(slow)) << large << " in round " << round;
  }
}

/// Derived polygons are those of a model that never saw anything else, and the alpha shape of all
/// inliers, whatever came, went and tilted; also after the model was saved and loaded.
TEST(SurfaceModel, PolygonsDoNotDependOnHistory) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 5 && !HasFailure(); ++round) {
    Eigen::Isometry3d pose = test::random_pose(rng);
    if (round % 2 == 0) pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round / 2));
    const std::vector<Inlier> all =
        test::voxels_of(test::random_blob(rng, 0.7, 0.1), pose, d, 0.7, 0.006, rng);
    std::vector<bool> in(all.size(), true);
    SurfaceModel model = model_of(all, pose);
    for (int step = 0; step < 40 && !HasFailure(); ++step) {
      // All near one place, so that cells fill and empty.
      const Eigen::Vector3f centre = all[rng() % all.size()].position;
      const bool out = rng() % 2 == 0;
      for (std::size_t i = 0; i < all.size(); ++i) {
        if ((all[i].position - centre).norm() > 0.15F || in[i] != out) continue;
        if (out)
          ASSERT_TRUE(model.remove(all[i].key, all[i].position));
        else
          model.add(all[i]);
        in[i] = !out;
      }
      Plane plane = model.plane();
      plane.normal =
          (plane.normal + 0.006 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng))).normalized();
      plane.offset = plane.normal.dot(pose.translation()) + 0.003 * uniform(rng);
      model.set_plane(plane);
      model.rehash_if_tilted();
      model.derive(h);
      SurfaceModel back(model.state(), d);
      back.derive(h);
      ASSERT_TRUE(test::identical(model.polygons(), back.polygons()))
          << "round " << round << " step " << step;
      ASSERT_EQ(test::ring_sets(model.polygons()), test::ring_sets(test::slow_polygons(model, h)));
    }
  }
}

/// Guarantee 2 of derive(): boundary points are inliers on the plane, up to what the hash frame's tilt
/// makes of their distance from it.
TEST(SurfaceModel, BoundaryPointsAreProjectedInliers) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> all = test::voxels_of(test::random_blob(rng, 0.7, 0.1), pose, d, 0.7, 0.006, rng);
  SurfaceModel model = model_of(all, pose);
  Plane plane = model.plane();
  plane.normal = Eigen::AngleAxisd(0.017, pose.linear().col(0)) * plane.normal;  // 0.97°
  plane.offset = plane.normal.dot(pose.translation());
  model.set_plane(plane);
  model.rehash_if_tilted();
  model.derive(h);
  const SurfacePtr surface = model.publish(1);
  for (const Eigen::Vector3d& p : surface->boundary) {
    bool found = false;
    for (const Inlier& inlier : all) {
      const Eigen::Vector3d q = inlier.position.cast<double>();
      const double off = plane.signed_distance(q);
      found = found || (q - off * plane.normal - p).norm() <= std::fabs(off) * std::sin(0.0175) + 4e-6;
    }
    EXPECT_TRUE(found) << p.transpose();
  }
}

/// Guarantee 3: fresh polygons are still right after whatever came and went without making them stale.
TEST(SurfaceModel, PolygonsThatAreNotStaleAreRight) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::size_t fresh = 0, wrong = 0;
  double worst = 0;
  for (int round = 0; round < 4 && !HasFailure(); ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    const std::vector<Inlier> all =
        test::voxels_of(test::random_blob(rng, 1.2, 0.05), pose, d, 1.2, 0.008, rng);
    SurfaceModel model =
        model_of({all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() * 99 / 100)}, pose);
    std::vector<bool> in(all.size(), false);
    for (std::size_t i = 0; i < all.size() * 99 / 100; ++i) in[i] = true;
    model.derive(h);
    for (int step = 0; step < 150 && !HasFailure(); ++step) {
      const std::size_t i = rng() % all.size();
      if (in[i])
        ASSERT_TRUE(model.remove(all[i].key, all[i].position));
      else
        model.add(all[i]);
      in[i] = !in[i];
      if (model.polygons_stale()) {
        model.derive(h);
        continue;
      }
      ++fresh;
      const double off = test::difference(model.polygons(), test::slow_polygons(model, h));
      worst = std::max(worst, off);
      if (off < 1e-9) continue;
      ++wrong;
      model.derive(h);
    }
  }
  EXPECT_EQ(wrong, 0U) << "of " << fresh << ", by up to " << worst << " m²";
  EXPECT_GT(fresh, 50U);
}

struct Sums {
  double count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();
};

TEST(SurfaceModel, MomentsSurviveChurn) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  Eigen::Isometry3d pose = test::random_pose(rng);
  pose.translation() += Eigen::Vector3d(120, -80, 3);  // digits are lost far from the origin, if anywhere
  const std::vector<Inlier> all = test::voxels_of(test::random_blob(rng, 0.6, 0.1), pose, d, 0.6, 0.006, rng);
  SurfaceModel model(1, test::plane_of(pose), pose.translation(), d);
  std::set<std::size_t> in;
  for (int step = 0; step < 60000; ++step) {
    const std::size_t i = rng() % all.size();
    if (in.erase(i) > 0) {
      ASSERT_TRUE(model.remove(all[i].key, all[i].position));
    } else {
      model.add(all[i]);
      in.insert(i);
    }
  }
  Sums plain, weighted;
  Parameters noisy;
  noisy.surfaces.range_noise = 0.002;
  const sensing::NoiseModel noise(noisy);
  double squares = 0;
  for (const std::size_t i : in) {
    const Eigen::Vector3d p = all[i].position.cast<double>() - model.reference();
    const double w = std::pow(noise.sigma(1) / noise.sigma(all[i].range_class), 2);
    for (auto [sums, weight] : {std::pair{&plain, 1.0}, {&weighted, w}}) {
      sums->count += weight;
      sums->sum += weight * p;
      sums->outer += weight * p * p.transpose();
    }
    squares += std::pow(model.distance(all[i].position), 2);
  }
  EXPECT_EQ(model.size(), in.size());
  for (const auto& [sums, moments] :
       {std::pair{plain, model.moments(nullptr)}, {weighted, model.moments(&noise)}}) {
    EXPECT_NEAR(moments.count, sums.count, 1e-6 * sums.count);
    EXPECT_LT((moments.sum - sums.sum).norm(), 1e-7 * sums.count);
    EXPECT_LT((moments.outer - sums.outer).norm(), 1e-7 * sums.count);
  }
  EXPECT_NEAR(model.rms(), std::sqrt(squares / static_cast<double>(in.size())), 1e-6);
}

TEST(SurfaceModel, CellsHoldExactlyTheInliers) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> all =
      test::voxels_of(test::random_blob(rng, 0.3, 0.06), pose, d, 0.3, 0.006, rng);
  const SurfaceModel model = model_of(all, pose);
  std::map<std::uint64_t, int> cells;
  for (const Inlier& inlier : all) {
    const geometry::PlaneCell cell = model.cell_of(inlier.position);
    ++cells[cell.packed()];
    const geometry::PlaneCell back = geometry::PlaneCell::unpack(cell.packed());
    EXPECT_TRUE(back.u == cell.u && back.v == cell.v);
    // The edge of a cell is d: its place in the plane says which one it is.
    const Eigen::Vector2d uv =
        (model.pose().inverse() * Eigen::Vector3d(inlier.position.cast<double>())).head<2>() / d;
    EXPECT_NEAR(uv.x(), cell.u + 0.5, 0.5 + 1e-3);
    EXPECT_NEAR(uv.y(), cell.v + 0.5, 0.5 + 1e-3);
  }
  const auto holds = [&](int u, int v) { return cells.contains(geometry::PlaneCell{u, v}.packed()); };
  for (int v = -20; v <= 20; ++v)
    for (int u = -20; u <= 20; ++u) {
      EXPECT_EQ(model.occupied({u, v}), holds(u, v));
      int neighbours = 0;
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) neighbours += (x != 0 || y != 0) && holds(u + x, v + y);
      EXPECT_EQ(model.covers({u, v}), holds(u, v) || neighbours >= 5);
      for (const int reach : {0, 1, 2, 4}) {
        bool any = false;
        for (int y = -reach; y <= reach; ++y)
          for (int x = -reach; x <= reach; ++x) any |= holds(u + x, v + y);
        EXPECT_EQ(model.nearest({u, v}, reach).has_value(), any);
      }
    }
}

TEST(SurfaceModel, RemovesOnlyWhatIsThere) {
  std::mt19937_64 rng = test::rng();
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> all =
      test::voxels_of(test::random_blob(rng, 0.3, 0.06), pose, d, 0.3, 0.006, rng);
  SurfaceModel model = model_of(all, pose);
  EXPECT_FALSE(model.remove({1, 2, 3}, all[0].position));
  EXPECT_FALSE(model.remove(all[0].key, all[0].position + Eigen::Vector3f(3, 3, 3)));
  EXPECT_TRUE(model.remove(all[0].key, all[0].position));
  EXPECT_FALSE(model.remove(all[0].key, all[0].position));
  EXPECT_EQ(model.size(), all.size() - 1);
}

TEST(SurfaceModel, WhatComesAndGoesAgainDoesNotChangeItsSize) {
  std::mt19937_64 rng(test::seed());
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> inliers =
      test::voxels_of(test::random_blob(rng, 0.8, 0.1), pose, d, 0.8, 0.006, rng);
  const std::size_t half = inliers.size() / 2;
  SurfaceModel model = model_of({inliers.begin(), inliers.begin() + static_cast<std::ptrdiff_t>(half)}, pose);
  EXPECT_TRUE(model.size_has_changed());  // it was never looked at
  model.set_checked();
  for (int round = 0; round < 20; ++round) {
    for (std::size_t i = 0; i < half / 4; ++i) ASSERT_TRUE(model.remove(inliers[i].key, inliers[i].position));
    for (std::size_t i = 0; i < half / 4; ++i) model.add(inliers[i]);
    EXPECT_FALSE(model.size_has_changed());
  }
  for (std::size_t i = half; i < 2 * half; ++i) {
    EXPECT_FALSE(model.size_has_changed());
    model.add(inliers[i]);
  }
  EXPECT_TRUE(model.size_has_changed());
  model.set_checked();
  for (std::size_t i = 0; 3 * i < 2 * half; ++i) {
    EXPECT_FALSE(model.size_has_changed());
    ASSERT_TRUE(model.remove(inliers[i].key, inliers[i].position));
  }
  EXPECT_TRUE(model.size_has_changed());
}

TEST(SurfaceModel, PoseMovesAsLittleAsPossible) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 200; ++round) {
    SurfaceModel model(1, test::plane_of(test::random_pose(rng)), {1, 2, 3}, d);
    for (int step = 0; step < 5; ++step) {
      const Eigen::Isometry3d before = model.pose();
      const Plane was = model.plane();
      Plane plane;
      plane.normal =
          (was.normal + 0.1 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng))).normalized();
      plane.offset = plane.normal.dot(before.translation()) + 0.05 * uniform(rng);
      model.set_plane(plane);
      const Eigen::Isometry3d after = model.pose();
      EXPECT_LT((after.linear().transpose() * after.linear() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      EXPECT_GT(after.linear().determinant(), 0);
      EXPECT_LT((after.linear().col(2) - plane.normal).norm(), 1e-12);
      EXPECT_NEAR(plane.signed_distance(after.translation()), 0, 1e-12);
      // The rotation is the one between the normals and the origin has moved along the normal.
      const double turned = Eigen::AngleAxisd(after.linear() * before.linear().transpose()).angle();
      EXPECT_NEAR(turned, std::acos(std::min(1.0, was.normal.dot(plane.normal))), 1e-7);
      EXPECT_NEAR((after.translation() - before.translation()).norm(),
                  std::fabs(plane.signed_distance(before.translation())), 1e-12);
    }
  }
}

TEST(SurfaceModel, KeepsItsInliersWhenItTilts) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  const Eigen::Isometry3d pose = test::random_pose(rng);
  const std::vector<Inlier> all =
      test::voxels_of(test::random_blob(rng, 0.4, 0.06), pose, d, 0.4, 0.006, rng);
  SurfaceModel model = model_of(all, pose);
  const auto before = model.moments(nullptr);
  Plane tilted = model.plane();
  tilted.normal = Eigen::AngleAxisd(0.1, pose.linear().col(0)) * tilted.normal;
  tilted.offset = tilted.normal.dot(pose.translation());
  model.set_plane(tilted);
  model.rehash_if_tilted();
  EXPECT_EQ(model.size(), all.size());
  EXPECT_LT((model.moments(nullptr).outer - before.outer).norm(), 1e-9);
  for (const Inlier& inlier : all) {
    const Eigen::Vector2d uv =
        (model.pose().inverse() * Eigen::Vector3d(inlier.position.cast<double>())).head<2>() / d;
    const geometry::PlaneCell cell = model.cell_of(inlier.position);
    EXPECT_NEAR(uv.x(), cell.u + 0.5, 0.51);
    EXPECT_NEAR(uv.y(), cell.v + 0.5, 0.51);
    EXPECT_TRUE(model.remove(inlier.key, inlier.position)) << "an inlier is in a cell where nobody looks";
  }
  EXPECT_EQ(model.size(), 0U);
}

TEST(SurfaceModel, StateComesBack) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  const Eigen::Isometry3d pose = test::random_pose(rng);
  std::vector<Inlier> all = test::voxels_of(test::random_blob(rng, 0.5, 0.08), pose, d, 0.5, 0.006, rng);
  SurfaceModel model = model_of(all, pose);
  model.parents() = {3, 5};
  model.derive(h);
  for (int i = 0; i < 20; ++i)
    model.remove(all[static_cast<std::size_t>(i)].key, all[static_cast<std::size_t>(i)].position);
  model.revision = 12;
  SurfaceModel back(model.state(), d);
  EXPECT_EQ(back.id(), model.id());
  EXPECT_EQ(back.size(), model.size());
  EXPECT_EQ(back.parents(), model.parents());
  EXPECT_EQ(back.revision, 12U);
  EXPECT_EQ(back.polygons_stale(), model.polygons_stale());
  EXPECT_EQ(back.pose().matrix(), model.pose().matrix());
  EXPECT_EQ(back.moments(nullptr).outer, model.moments(nullptr).outer);
  EXPECT_EQ(test::ring_sets(back.polygons()), test::ring_sets(model.polygons()));
  // Both go on alike.
  for (std::size_t i = 20; i < 60; ++i) {
    EXPECT_EQ(back.remove(all[i].key, all[i].position), model.remove(all[i].key, all[i].position));
    EXPECT_EQ(back.polygons_stale(), model.polygons_stale());
  }
  back.derive(h);
  model.derive(h);
  const SurfacePtr a = back.publish(13), b = model.publish(13);
  EXPECT_EQ(a->area_m2, b->area_m2);
  EXPECT_EQ(a->rms_m, b->rms_m);
  ASSERT_EQ(a->boundary.size(), b->boundary.size());
  for (std::size_t i = 0; i < a->boundary.size(); ++i) EXPECT_EQ(a->boundary[i], b->boundary[i]);
}

TEST(SurfaceModel, PublishesWhatTheHeaderPromises) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  for (int round = 0; round < 5; ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    SurfaceModel model =
        model_of(test::voxels_of(test::random_blob(rng, 0.6, 0.1), pose, d, 0.6, 0.006, rng), pose);
    model.derive(h);
    const SurfacePtr surface = model.publish(4);
    EXPECT_EQ(surface->inliers, model.size());
    EXPECT_EQ(test::invalid(surface->polygons), "");
    EXPECT_EQ(test::invalid(simplified(*surface)), "");
    EXPECT_EQ(surface->boundary.size(), test::count_vertices(surface->polygons));
    EXPECT_NEAR(surface->area_m2, test::area(surface->polygons), 1e-9);
    for (const Eigen::Vector3d& p : surface->boundary)
      EXPECT_NEAR(surface->plane.signed_distance(p), 0, 1e-9);
    // An inlier outside is one at which no Delaunay triangle (no point in its circumcircle) has all
    // sides within h.
    const test::Region region(surface->polygons);
    std::vector<Eigen::Vector2d> all;
    model.for_each_inlier([&](const Inlier& inlier) {
      all.push_back(
          (surface->T_map_surface.inverse() * Eigen::Vector3d(inlier.position.cast<double>())).head<2>());
    });
    for (const Eigen::Vector2d& p : all) {
      if (region.covers(p) || test::distance_to_rings(p, surface->polygons) < 4e-6) continue;  // a quantum
      std::vector<Eigen::Vector2d> near;
      for (const Eigen::Vector2d& q : all)
        if (q != p && (q - p).norm() <= h) near.push_back(q);
      int triangles = 0;
      for (const Eigen::Vector2d& q : near)
        for (const Eigen::Vector2d& r : near) {
          const Eigen::Vector2d a = q - p, b = r - p;
          const double twice = 2 * (a.x() * b.y() - a.y() * b.x());
          if (q == r || (q - r).norm() > h || std::abs(twice) < 1e-15) continue;
          const Eigen::Vector2d centre((b.y() * a.squaredNorm() - a.y() * b.squaredNorm()) / twice,
                                       (a.x() * b.squaredNorm() - b.x() * a.squaredNorm()) / twice);
          triangles += std::none_of(all.begin(), all.end(), [&](const Eigen::Vector2d& o) {
            return (o - p - centre).norm() < centre.norm() * (1 - 1e-9);
          });
        }
      EXPECT_EQ(triangles, 0) << "with " << near.size() << " neighbours, " << all.size() << " inliers";
    }
  }
}

TEST(SurfaceModel, AnEmptyOneHasNoPolygons) {
  SurfaceModel model(1, {Eigen::Vector3d::UnitZ(), 1}, {0, 0, 1}, d);
  model.derive(h);
  EXPECT_TRUE(model.polygons().empty());
  EXPECT_FALSE(model.occupied({0, 0}));
}

TEST(PlaneAxes, AreAFrameWhoseXIsHorizontal) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> gauss;
  std::vector<Eigen::Vector3d> normals;
  for (int a = 0; a < 3; ++a) {
    normals.push_back(Eigen::Vector3d::Unit(a));
    normals.push_back(-Eigen::Vector3d::Unit(a));
  }
  normals.push_back(Eigen::Vector3d(1, 1, 0).normalized());
  normals.push_back(Eigen::Vector3d(1, 1, 1).normalized());
  for (int i = 0; i < 500; ++i)
    normals.push_back(Eigen::Vector3d(gauss(rng), gauss(rng), gauss(rng)).normalized());
  for (const Eigen::Vector3d& n : normals) {
    const Eigen::Matrix3d axes = geometry::plane_axes(n);
    EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), 1e-12) << n.transpose();
    EXPECT_NEAR(axes.determinant(), 1, 1e-12);
    EXPECT_LT((axes.col(2) - n).norm(), 1e-12);
    EXPECT_NEAR(axes(2, 0), 0, 1e-12) << "x is not horizontal for the normal " << n.transpose();
  }
}

TEST(Colour, FirstSixtyFourAreDistinct) {
  std::vector<Eigen::Vector3f> colours;
  for (SurfaceId id = 1; id <= 64; ++id) {
    const auto c = color_of(id);
    colours.emplace_back(c[0], c[1], c[2]);
    EXPECT_GE(colours.back().minCoeff(), 0);
    EXPECT_LE(colours.back().maxCoeff(), 1);
  }
  for (std::size_t a = 0; a < colours.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GT((colours[a] - colours[b]).cwiseAbs().maxCoeff(), 4.0F / 255) << a + 1 << " and " << b + 1;
}

}  // namespace
}  // namespace octosurf::surfaces
