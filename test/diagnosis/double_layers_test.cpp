// Double layers of snapshots put together by hand; areas, distances and angles follow from the drawing.
#include "support/seed.hpp"

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <memory>
#include <numbers>
#include <random>

#include <octosurf/diagnosis.hpp>
#include <octosurf/error.hpp>

namespace octosurf::diagnosis {
namespace {

constexpr double deg = std::numbers::pi / 180;

Ring2 rectangle(double u, double v, double width, double height) {
  return {{u, v}, {u + width, v}, {u + width, v + height}, {u, v + height}};
}
Ring2 hole(double u, double v, double width, double height) {
  return {{u, v}, {u, v + height}, {u + width, v + height}, {u + width, v}};
}

class DoubleLayers : public ::testing::Test {
 protected:
  /// A surface with frame T (z its normal) in the map.
  SurfaceId add(const Eigen::Isometry3d& T, const std::vector<Polygon>& polygons, double area_m2) {
    auto surface = std::make_shared<Surface>();
    surface->id = static_cast<SurfaceId>(3 * snapshot_.surfaces.size() + 2);
    surface->T_map_surface = T_map_ * T;
    surface->plane.normal = surface->T_map_surface.linear().col(2);
    surface->plane.offset = surface->plane.normal.dot(surface->T_map_surface.translation());
    surface->polygons = polygons;
    surface->area_m2 = area_m2;
    snapshot_.surfaces.push_back(surface);
    return surface->id;
  }
  /// A level rectangle at height z.
  SurfaceId add_level(double x, double y, double z, double width, double height) {
    return add(at(0, 0, z), {{rectangle(x, y, width, height), {}}}, width * height);
  }
  static Eigen::Isometry3d at(double x, double y, double z) {
    return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
  }
  std::vector<DoubleLayer> found(const DoubleLayerOptions& options = {}) const {
    return double_layers(snapshot_, options);
  }

  Snapshot snapshot_{0, 0.02, {}};
  Eigen::Isometry3d T_map_ = Eigen::Isometry3d::Identity();  // the whole scene's place
};

TEST_F(DoubleLayers, TwoSheetsOfOneFloor) {
  const SurfaceId floor = add_level(0, 0, 0, 4, 3);
  const SurfaceId sheet = add_level(3.5, 1, 0.03, 1, 1);  // half of it over the floor
  const auto layers = found();
  ASSERT_EQ(layers.size(), 1U);
  EXPECT_EQ(layers[0].first, floor);
  EXPECT_EQ(layers[0].second, sheet);
  EXPECT_NEAR(layers[0].overlap_m2, 0.5, 1e-9);
  EXPECT_NEAR(layers[0].distance_m, 0.03, 1e-12);
  EXPECT_NEAR(layers[0].angle_rad, 0, 1e-9);
}

TEST_F(DoubleLayers, WhatOverlapsLittleIsNone) {
  add_level(0, 0, 0, 4, 3);
  add_level(3.81, 1, 0.01, 1, 1);  // 19 % of it
  EXPECT_TRUE(found().empty());
  add_level(3.79, 1, -0.01, 1, 1);  // 21 %; and nearly all of the one before
  EXPECT_EQ(found().size(), 2U);
}

TEST_F(DoubleLayers, WhatIsFarApartIsNone) {
  EXPECT_TRUE(found().empty());
  add(at(0, 0, 0), {}, 0);
  add_level(0, 0, 0, 4, 3);
  add_level(1, 1, 0.051, 1, 1);
  EXPECT_TRUE(found().empty());
  DoubleLayerOptions options;
  options.max_distance_m = 0.06;
  EXPECT_EQ(found(options).size(), 1U);
}

TEST_F(DoubleLayers, NeighboursInOnePlaneAreNone) {
  add_level(0, 0, 0, 1, 1);
  add_level(1, 0, 0, 1, 1);
  add_level(0, 1.001, 0.002, 1, 1);
  EXPECT_TRUE(found().empty());
}

TEST_F(DoubleLayers, TheTwoSidesOfAThinWallAreNone) {
  add_level(0, 0, 0.02, 1, 1);
  Eigen::Isometry3d back = at(0, 1, 0);
  back.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  add(back, {{rectangle(0, 0, 1, 1), {}}}, 1);
  EXPECT_TRUE(found().empty());
}

TEST_F(DoubleLayers, ABoardOverAHoleIsNoneAndOneOverFloorIs) {
  const SurfaceId floor = add(at(0, 0, 0), {{rectangle(0, 0, 4, 3), {hole(1, 1, 0.6, 0.4)}}}, 12 - 0.24);
  add_level(1, 1, 0.04, 0.6, 0.4);
  EXPECT_TRUE(found().empty());
  const SurfaceId board = add_level(2, 1, 0.04, 0.6, 0.4);
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].first, floor);
  EXPECT_EQ(found()[0].second, board);
  EXPECT_NEAR(found()[0].overlap_m2, 0.24, 1e-9);
}

TEST_F(DoubleLayers, AnIslandInAHoleCounts) {
  add(at(0, 0, 0), {{rectangle(0, 0, 4, 3), {hole(1, 1, 1, 1)}}, {rectangle(1.2, 1.2, 0.6, 0.6), {}}},
      12 - 1 + 0.36);
  add_level(1, 1, 0.01, 1, 1);
  ASSERT_EQ(found().size(), 1U);
  EXPECT_NEAR(found()[0].overlap_m2, 0.36, 0.01 * 0.6);  // rows of 1 cm meet its edges within half of one
}

TEST_F(DoubleLayers, ATiltedSheetCountsWhereItIsNear) {
  add_level(-2, -2, 0, 4, 4);
  Eigen::Isometry3d T = at(0, 0, 0);
  T.rotate(Eigen::AngleAxisd(10 * deg, Eigen::Vector3d::UnitY()));
  add(T, {{rectangle(-0.5, -0.5, 1, 1), {}}}, 1);
  const auto layers = found();
  ASSERT_EQ(layers.size(), 1U);
  EXPECT_NEAR(layers[0].angle_rad, 10 * deg, 1e-9);
  // Along the sheet's normal the floor is tan 10° · |u| away: near for |u| up to 5 cm / tan 10°.
  const double reach = 0.05 / std::tan(10 * deg);
  EXPECT_NEAR(layers[0].overlap_m2, 2 * reach, 1e-9);
  EXPECT_NEAR(layers[0].distance_m, 0.025, 1e-9);

  add(T, {{rectangle(-2, -0.5, 4, 1), {}}}, 4);  // 14 % of it are near the floor, but it is on the other
  EXPECT_EQ(found().size(), 2U);
  Eigen::Isometry3d steep = at(0, 1, 0);
  steep.rotate(Eigen::AngleAxisd(16 * deg, Eigen::Vector3d::UnitY()));
  add(steep, {{rectangle(-0.2, -0.2, 0.4, 0.4), {}}}, 0.16);
  EXPECT_EQ(found().size(), 2U);
}

TEST_F(DoubleLayers, DoNotDependOnWhereTheSceneIs) {
  std::mt19937_64 rng(test::seed());
  std::normal_distribution<double> gauss;
  T_map_.linear() =
      Eigen::Quaterniond(gauss(rng), gauss(rng), gauss(rng), gauss(rng)).normalized().toRotationMatrix();
  T_map_.translation() = Eigen::Vector3d(100 * gauss(rng), 100 * gauss(rng), gauss(rng));
  add_level(0, 0, 0, 4, 3);
  Eigen::Isometry3d turned = at(1, 1, 0.03);
  turned.rotate(Eigen::AngleAxisd(gauss(rng), Eigen::Vector3d::UnitZ()));
  add(turned, {{rectangle(-0.3, -0.2, 0.6, 0.4), {}}}, 0.24);
  ASSERT_EQ(found().size(), 1U);
  EXPECT_NEAR(found()[0].overlap_m2, 0.24, 1e-9);  // rows run in the smaller one's own frame
  EXPECT_NEAR(found()[0].distance_m, 0.03, 1e-9);
}

TEST_F(DoubleLayers, NonsenseOptionsAreRefusedByName) {
  const auto refused = [&](DoubleLayerOptions options, const char* name) {
    try {
      found(options);
      ADD_FAILURE() << name << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::usage);
      EXPECT_THAT(error.what(), ::testing::HasSubstr(name));
    }
  };
  DoubleLayerOptions angle, distance, share;
  angle.max_angle_rad = 1;
  distance.max_distance_m = std::numeric_limits<double>::quiet_NaN();
  share.min_overlap = 0;
  refused(angle, "max_angle_rad");
  refused(distance, "max_distance_m");
  refused(share, "min_overlap");
}

}  // namespace
}  // namespace octosurf::diagnosis
