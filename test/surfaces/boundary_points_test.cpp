// Where polygons end: at the readings' end, not at the centroids of the outermost voxels.
#include "support/polygons.hpp"
#include "surfaces/blobs.hpp"
#include "surfaces/surface_model.hpp"

namespace octosurf::surfaces {
namespace {

using test::d;
using test::h;
using test::model_of;
using test::noise_of;

/// Readings every millimetre over a rectangle of a plane, by voxel.
std::vector<Inlier> voxels_of_rectangle(const Eigen::Isometry3d& pose, const Eigen::Vector2d& size) {
  constexpr double spacing = 0.001;
  test::VoxelMeans voxels(d);
  for (double u = spacing / 2; u < size.x(); u += spacing)
    for (double v = spacing / 2; v < size.y(); v += spacing) voxels.add(pose * Eigen::Vector3d(u, v, 0));
  return voxels.inliers();
}

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
