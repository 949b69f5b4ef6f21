// Where surfaces end on each other: at the line of their planes, not where the voxels of one begin.
#include "support/polygons.hpp"
#include "surfaces/blobs.hpp"
#include "surfaces/surface_store.hpp"

namespace octosurf::surfaces {
namespace {

using test::d;
using test::h;

/// Sites of intersections are rounded to an eighth of a cell along each axis.
constexpr double rounding = d / 8;

/// Readings over a rectangle from the origin of `pose` along its x and y, by voxel. `spacing`: m, along both.
std::vector<Inlier> voxels_of_rectangle(const Eigen::Isometry3d& pose, const Eigen::Vector2d& size,
                                        const Eigen::Vector2d& spacing = {0.001, 0.001}) {
  test::VoxelMeans voxels(d);
  for (double u = spacing.x() / 2; u < size.x(); u += spacing.x())
    for (double v = spacing.y() / 2; v < size.y(); v += spacing.y())
      voxels.add(pose * Eigen::Vector3d(u, v, 0));
  return voxels.inliers();
}

/// Rectangular faces in a store, of readings on a grid; a voxel is the first's that has readings in it, as
/// the octree has it.
class Faces {
 public:
  SurfaceModel& add(const Eigen::Isometry3d& pose, const Eigen::Vector2d& size,
                    const Eigen::Vector2d& spacing = {0.001, 0.001}) {
    SurfaceModel& model = store.create(test::plane_of(pose), pose.translation());
    for (const Inlier& inlier : voxels_of_rectangle(pose, size, spacing))
      if (taken_.insert(inlier.key.packed()).second) store.add(model, inlier);
    return model;
  }

  SurfaceStore store{d};

 private:
  std::set<std::uint64_t> taken_;
};

/// m, along y from a face's x axis to where its polygons begin, mean over its length less the corners, and
/// the least; what is not met within 10 cm counts as that.
struct Gap {
  double mean = 0, least = 1;
};
Gap gap_at_x_axis(const SurfaceModel& model, const Eigen::Isometry3d& pose, double length) {
  const test::Region region(model.polygons());
  const Eigen::Isometry3d T = model.pose().inverse() * pose;
  Gap gap;
  int count = 0;
  for (double u = 0.06; u < length - 0.06; u += 0.003) {
    double v = -0.05;
    while (v < 0.1 && !region.covers((T * Eigen::Vector3d(u, v, 0)).head<2>())) v += 0.0005;
    gap.mean += v;
    gap.least = std::min(gap.least, v);
    ++count;
  }
  gap.mean /= count;
  return gap;
}

/// The same frame turned about its x axis.
Eigen::Isometry3d turned(const Eigen::Isometry3d& pose, double angle) {
  return pose * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
}

/// However the edge lies, and sharp or blunt as it is: never beyond it, hardly ever before it. Three faces in
/// 600 ended more than an eighth of a voxel before it on the mean, where voxels lie along it.
TEST(Intersections, FacesEndAtTheirCommonEdge) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> angle(0.4, std::numbers::pi - 0.4);  // 23° to 157°
  int exact = 0;
  for (int round = 0; round < 10 && !HasFailure(); ++round) {
    const Eigen::Isometry3d a = test::random_pose(rng), b = turned(a, angle(rng));
    Faces faces;
    std::vector<std::pair<SurfaceModel*, Eigen::Isometry3d>> both;
    for (const Eigen::Isometry3d& pose : {a, b}) both.emplace_back(&faces.add(pose, {0.5, 0.3}), pose);
    for (const auto& [face, pose] : both) {
      SurfaceModel& model = *face;
      model.derive(h);
      const Gap bare = gap_at_x_axis(model, pose, 0.5);
      model.derive(h, nullptr, &faces.store);
      const Gap beside = gap_at_x_axis(model, pose, 0.5);
      EXPECT_LE(beside.mean, std::max(bare.mean, rounding)) << "round " << round;
      EXPECT_GE(beside.least, -2 * rounding) << "round " << round;
      exact += std::fabs(beside.mean) <= rounding;
      EXPECT_TRUE(test::invalid(model.polygons()).empty()) << test::invalid(model.polygons());
    }
  }
  EXPECT_GE(exact, 17) << "of 20";
}

/// Where the voxels at a corner are two other faces', none of the third's may be near to both of them: its
/// tip is cut then, by less than two voxels.
TEST(Intersections, ThreeFacesEndInTheirCorner) {
  std::mt19937_64 rng = test::rng();
  int exact = 0;
  for (int round = 0; round < 6 && !HasFailure(); ++round) {
    const Eigen::Isometry3d corner = test::random_pose(rng);
    Faces faces;
    std::vector<std::pair<SurfaceModel*, Eigen::Isometry3d>> three;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Matrix3d axes;
      axes << Eigen::Vector3d::Unit((axis + 1) % 3), Eigen::Vector3d::Unit((axis + 2) % 3),
          Eigen::Vector3d::Unit(axis);
      const Eigen::Isometry3d pose = corner * Eigen::Isometry3d(Eigen::AngleAxisd(axes));
      three.emplace_back(&faces.add(pose, {0.3, 0.3}), pose);
    }
    for (const auto& [model, pose] : three) {
      model->derive(h, nullptr, &faces.store);
      const Eigen::Vector3d tip = model->pose().inverse() * pose.translation();
      const double off = test::distance_to_rings(tip.head<2>(), model->polygons());
      EXPECT_LE(off, 2 * d) << "round " << round;
      exact += off <= 2 * rounding;
    }
  }
  EXPECT_GE(exact, 12) << "of 18";
}

/// A lidar's rows lie farther apart than voxels, and the next one would have been on the other face.
TEST(Intersections, SparseRowsLeaveNoStripAtAnEdge) {
  std::mt19937_64 rng = test::rng();
  for (int round = 0; round < 6 && !HasFailure(); ++round) {
    const Eigen::Isometry3d a = test::random_pose(rng), b = turned(a, std::numbers::pi / 2);
    Faces faces;
    SurfaceModel& dense = faces.add(a, {0.5, 0.3});
    SurfaceModel& rows = faces.add(b, {0.5, 0.3}, {0.005, 0.06});  // the first one 3 cm off the edge
    rows.derive(h);
    EXPECT_NEAR(gap_at_x_axis(rows, b, 0.5).mean, 0.03, 1e-3);
    rows.derive(h, nullptr, &faces.store);
    dense.derive(h, nullptr, &faces.store);
    EXPECT_LE(std::fabs(gap_at_x_axis(rows, b, 0.5).mean), rounding) << "round " << round;
    EXPECT_LE(std::fabs(gap_at_x_axis(dense, a, 0.5).mean), rounding) << "round " << round;
  }
}

/// A board that ends three to four voxels before a wall was seen to: there would have been further rows. And
/// a plane goes on for ever, a surface does not: where the other one has no inliers, nothing is met.
TEST(Intersections, WhatEndsBeforeAWallOrBelowItDoesNotReachIt) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> before(3 * d, 4 * d);
  for (int round = 0; round < 12 && !HasFailure(); ++round) {
    const Eigen::Isometry3d wall = test::random_pose(rng);
    Eigen::Isometry3d board = turned(wall, std::numbers::pi / 2);
    board.translation() =
        wall * (round % 2 == 0 ? Eigen::Vector3d(0, 0.2, before(rng)) : Eigen::Vector3d(0, -0.15, 0));
    Faces faces;
    faces.add(wall, {0.5, 0.4});
    SurfaceModel& model = faces.add(board, {0.5, 0.3});
    model.derive(h);
    const std::vector<Polygon> bare = model.polygons();
    model.derive(h, nullptr, &faces.store);
    EXPECT_TRUE(test::identical(model.polygons(), bare)) << "round " << round;
  }
}

/// As SurfaceModel.PolygonsDoNotDependOnHistory, while both surfaces and their planes become others.
TEST(Intersections, DoNotDependOnHistory) {
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<double> move(0, 0.003);
  for (int round = 0; round < 3 && !HasFailure(); ++round) {
    const Eigen::Isometry3d a = test::random_pose(rng), b = turned(a, 1.2);
    Faces faces;
    std::vector<std::pair<SurfaceModel*, std::vector<Inlier>>> both;
    for (const Eigen::Isometry3d& pose : {a, b}) {
      SurfaceModel& model = faces.add(pose, {0.4, 0.3}, {0.003, 0.003});
      both.emplace_back(&model, model.sorted_inliers());
    }
    std::size_t met = 0;
    for (int step = 0; step < 30 && !HasFailure(); ++step) {
      auto& [model, all] = both[rng() % 2];
      const Eigen::Vector3f centre = all[rng() % all.size()].position;
      const bool out = rng() % 2 == 0;
      for (const Inlier& inlier : all) {
        if ((inlier.position - centre).norm() > 0.08F) continue;
        const bool had = faces.store.remove(*model, inlier.key, inlier.position);
        if (!out || (had && step % 3 == 0)) faces.store.add(*model, inlier);
      }
      Plane plane = model->plane();
      plane.offset += move(rng);
      model->set_plane(plane);
      model->rehash_if_tilted();
      for (const auto& [each, its] : both) {
        each->derive(h, nullptr, &faces.store);
        SurfaceModel back(each->state(), d);
        back.derive(h, nullptr, &faces.store);
        ASSERT_TRUE(test::identical(each->polygons(), back.polygons()))
            << "round " << round << " step " << step;
        ASSERT_EQ(test::ring_sets(each->polygons()), test::ring_sets(test::slow_polygons(*each, h)));
        ASSERT_TRUE(test::invalid(each->polygons()).empty()) << test::invalid(each->polygons());
        const std::vector<Polygon> with = each->polygons();
        back.derive(h);
        met += !test::identical(with, back.polygons());
      }
    }
    EXPECT_GT(met, 30U) << "of 60 derivations that meet the other";
  }
}

// Where polygons end: at the readings' end, not at the centroids of the outermost voxels.

using test::model_of;
using test::noise_of;

/// How far a model's polygons end inside the rectangle, m, mean over its sides less their corners, where
/// they are not met at all counting as 5 cm; negative: outside.
double inset(const SurfaceModel& model, const Eigen::Isometry3d& pose, const Eigen::Vector2d& size) {
  const test::Region region(model.polygons());
  const Eigen::Isometry3d T = model.pose().inverse() * pose;
  double sum = 0;
  int count = 0;
  const auto probe = [&](const Eigen::Vector2d& edge, const Eigen::Vector2d& inward) {
    double depth = -0.03;
    while (depth < 0.05) {
      const Eigen::Vector2d p = edge + depth * inward;
      if (region.covers((T * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>())) break;
      depth += 0.0005;
    }
    sum += depth;
    ++count;
  };
  constexpr double corner = 0.05;
  for (double u = corner; u < size.x() - corner; u += 0.003) {
    probe({u, 0}, {0, 1});
    probe({u, size.y()}, {0, -1});
  }
  for (double v = corner; v < size.y() - corner; v += 0.003) {
    probe({0, v}, {1, 0});
    probe({size.x(), v}, {-1, 0});
  }
  return sum / count;
}

/// With sides along the voxels' the readings of a voxel fill a box, whose inner side is the voxel's, and so
/// its end is known exactly: less the 2 mm that noise of 1 mm may reach.
TEST(Boundary, ReachesTheReadingsEndAlongTheVoxels) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(0.0085, d - 0.0085);
  for (int round = 0; round < 6 && !HasFailure(); ++round) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round % 3));
    // In the middle of a layer of voxels. A voxel that is filled by 8 mm and more has its mean 2 mm and more
    // before where the boundary point comes to stand, which is worth a site.
    pose.translation() = Eigen::Vector3d::Constant(d / 2);
    const Eigen::Vector2d start(uniform(rng), uniform(rng));
    pose.translation() += pose.linear().leftCols<2>() * (start - Eigen::Vector2d::Constant(d / 2));
    const Eigen::Vector2d size(0.4 + uniform(rng) - start.x(), 0.3 + uniform(rng) - start.y());
    SurfaceModel model = model_of(voxels_of_rectangle(pose, size), pose);
    const sensing::NoiseModel noise = noise_of(0.001);
    model.derive(h, &noise);
    EXPECT_NEAR(inset(model, pose, size), 0.002, 0.001) << "round " << round;
  }
}

/// However the rectangle lies: centroids alone end inside of it. What is taken for a box may be a triangle,
/// whose readings end a third of its height earlier or later: less than an eighth of a voxel on the whole.
TEST(Boundary, IsHardlyBiasedHoweverAFaceLies) {
  std::mt19937_64 rng = test::rng();
  const Eigen::Vector2d size(0.5, 0.4);
  const sensing::NoiseModel noise = noise_of(0.001);
  for (int round = 0; round < 8 && !HasFailure(); ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    SurfaceModel model = model_of(voxels_of_rectangle(pose, size), pose);
    model.derive(h);
    const double bare = inset(model, pose, size);
    model.derive(h, &noise);
    const double with = inset(model, pose, size);
    EXPECT_LT(with, bare) << "round " << round;
    EXPECT_LT(std::fabs(with), d / 8) << "round " << round;
    EXPECT_TRUE(test::invalid(model.polygons()).empty()) << test::invalid(model.polygons());
  }
}

TEST(Boundary, PointsStayInTheirVoxels) {
  std::mt19937_64 rng = test::rng();
  for (int round = 0; round < 8 && !HasFailure(); ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    SurfaceModel model =
        model_of(test::voxels_of(test::random_blob(rng, 0.6, 0.1), pose, d, 0.6, 0.006, rng), pose);
    std::size_t points = 0;
    model.for_each_inlier([&](const Inlier& inlier) {
      const auto p = model.boundary_point(inlier, 0);
      if (!p) return;
      ++points;
      const Eigen::Vector3f off = *p - geometry::VoxelGrid(d).centre_of(inlier.key);
      EXPECT_LE(off.cwiseAbs().maxCoeff(), d / 2 + 1e-5);
      EXPECT_FALSE(model.surrounded(model.cell_of(inlier.position)));
    });
    EXPECT_GT(points, 20U);
  }
}

/// What lies wholly within the reach of its noise says nothing about where it ends.
TEST(Boundary, NoiseOfHalfAVoxelLeavesTheCentroids) {
  std::mt19937_64 rng = test::rng();
  const Eigen::Isometry3d pose = test::random_pose(rng);
  SurfaceModel model =
      model_of(test::voxels_of(test::random_blob(rng, 0.6, 0.1), pose, d, 0.6, 0.006, rng), pose);
  const sensing::NoiseModel noise = noise_of(d / 2);
  model.derive(h, &noise);
  const std::vector<Polygon> with = model.polygons();
  model.derive(h);
  EXPECT_TRUE(test::identical(model.polygons(), with));
}

}  // namespace
}  // namespace octosurf::surfaces
