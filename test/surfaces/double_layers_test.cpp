// Double layers of sheets whose overlap and distance follow from the drawing.
#include "support/double_layers.hpp"

#include "support/testing.hpp"
#include "surfaces/blobs.hpp"

namespace octosurf::surfaces {
namespace {

using test::double_layers;
using test::DoubleLayer;

using test::d;

Eigen::Isometry3d at(double x, double y, double z, double tilt_rad = 0) {
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitY());
}

class DoubleLayers : public ::testing::Test {
 protected:
  /// A sheet on the plane z = 0 of T, its middle at the origin, less a square hole in its middle.
  SurfaceId add(const Eigen::Isometry3d& T, double width, double height, double hole = 0) {
    SurfaceModel& sheet = store_.create(test::plane_of(T), T.translation());
    test::VoxelMeans voxels(d);
    for (double u = -width / 2 + d / 4; u < width / 2; u += d / 2)
      for (double v = -height / 2 + d / 4; v < height / 2; v += d / 2)
        if (std::max(std::fabs(u), std::fabs(v)) > hole / 2) voxels.add(T * Eigen::Vector3d(u, v, 0));
    for (const Inlier& inlier : voxels.inliers()) store_.add(sheet, inlier);
    return sheet.id();
  }
  std::vector<DoubleLayer> found() const { return double_layers(store_); }

  SurfaceStore store_{d};
};

TEST_F(DoubleLayers, TwoSheetsOfOneFloor) {
  const SurfaceId sheet = add(at(2, 0, 0.03), 1, 1);
  const SurfaceId floor = add(at(0, 0, 0), 4, 3);  // under half of it
  const auto layers = found();
  ASSERT_EQ(layers.size(), 1U);
  EXPECT_EQ(layers[0].smaller, sheet);
  EXPECT_EQ(layers[0].larger, floor);
  EXPECT_NEAR(static_cast<double>(layers[0].inliers), 0.5 * 50 * 50, 50) << "a row of voxels";
  EXPECT_NEAR(layers[0].distance_m, 0.03, 1e-6);
}

TEST_F(DoubleLayers, WhatOverlapsLittleOrIsFarApartIsNone) {
  add(at(0, 0, 0), 4, 3);
  add(at(2.34, 0, 0.03), 1, 1);  // 16 % of it
  add(at(0, 0, 0.051), 1, 1);
  EXPECT_TRUE(found().empty());
  add(at(-2.26, 0, 0.03), 1, 1);  // 24 %
  add(at(0, 1, -0.049), 0.8, 0.8);
  EXPECT_EQ(found().size(), 2U);
}

TEST_F(DoubleLayers, NeighboursInOnePlaneAreNone) {
  add(at(0.5, 0.5, 0.01), 1, 1);
  add(at(1.5, 0.5, 0.01), 1, 1);
  add(at(0.5, 1.02, 0.01), 1, 0.04);  // a strip of two voxels
  EXPECT_TRUE(found().empty());
}

TEST_F(DoubleLayers, TheTwoSidesOfAThinWallAreNone) {
  add(at(0, 0, 0.02), 1, 1);
  add(at(0, 0, 0, std::numbers::pi), 1, 1);
  EXPECT_TRUE(found().empty());
}

TEST_F(DoubleLayers, ABoardOverAHoleIsNoneAndOneOverFloorIs) {
  add(at(0, 0, 0), 4, 3, 0.6);
  add(at(0, 0, 0.04), 0.6, 0.6);
  EXPECT_TRUE(found().empty());
  const SurfaceId board = add(at(1, 0, 0.04), 0.6, 0.4);
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].smaller, board);
  EXPECT_EQ(found()[0].inliers, store_.find(board)->size());
}

TEST_F(DoubleLayers, ATiltedSheetCountsWhereItIsNear) {
  constexpr double deg = std::numbers::pi / 180;
  add(at(0, 0, 0), 4, 4);
  add(at(0, 0, 0, 16 * deg), 0.2, 0.4);
  EXPECT_TRUE(found().empty());
  add(at(0, -1, 0, 10 * deg), 1, 1);   // near up to 29 cm to both sides
  add(at(0, 1, 0, 10 * deg), 4, 0.5);  // 14 % of it
  ASSERT_EQ(found().size(), 1U);
  EXPECT_NEAR(found()[0].distance_m, 0.025, 1e-3);
}

}  // namespace
}  // namespace octosurf::surfaces
