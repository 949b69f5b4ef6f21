// Double layers of sheets whose overlap and distance follow from the drawing.
#include "support/double_layers.hpp"

#include "surfaces/blobs.hpp"

namespace octosurf::surfaces {
namespace {

using test::d;
using test::double_layers;

Eigen::Isometry3d at(double x, double y, double z, double tilt_rad = 0) {
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitY());
}

/// A sheet on the plane z = 0 of T, its middle at the origin, less a square hole in its middle.
struct Sheet {
  Eigen::Isometry3d T;
  double width, height, hole = 0;
};

SurfaceId add(SurfaceStore& store, const Sheet& sheet) {
  SurfaceModel& surface = store.create(test::plane_of(sheet.T), sheet.T.translation());
  test::VoxelMeans voxels(d);
  for (double u = -sheet.width / 2 + d / 4; u < sheet.width / 2; u += d / 2)
    for (double v = -sheet.height / 2 + d / 4; v < sheet.height / 2; v += d / 2)
      if (std::max(std::fabs(u), std::fabs(v)) > sheet.hole / 2)
        voxels.add(sheet.T * Eigen::Vector3d(u, v, 0));
  for (const Inlier& inlier : voxels.inliers()) store.add(surface, inlier);
  return surface.id();
}

TEST(DoubleLayers, TwoSheetsOfOneFloor) {
  SurfaceStore store(d);
  const SurfaceId sheet = add(store, {at(2, 0, 0.03), 1, 1});
  const SurfaceId floor = add(store, {at(0, 0, 0), 4, 3});  // under half of it
  const auto layers = double_layers(store);
  ASSERT_EQ(layers.size(), 1U);
  EXPECT_EQ(layers[0].smaller, sheet);
  EXPECT_EQ(layers[0].larger, floor);
  EXPECT_NEAR(static_cast<double>(layers[0].inliers), 0.5 * 50 * 50, 50) << "a row of voxels";
  EXPECT_NEAR(layers[0].distance_m, 0.03, 1e-6);
}

TEST(DoubleLayers, AreWhatOverlapsEnoughNearAndFacesTheSameWay) {
  constexpr double deg = std::numbers::pi / 180;
  struct Case {
    const char* what;
    std::vector<Sheet> sheets;
    std::size_t layers;
  };
  const Sheet floor{at(0, 0, 0), 4, 3}, holed{at(0, 0, 0), 4, 3, 0.6};
  for (const auto& [what, sheets, layers] :
       {Case{"overlaps by 16 %, or is 51 mm off",
             {floor, {at(2.34, 0, 0.03), 1, 1}, {at(0, 0, 0.051), 1, 1}},
             0},
        Case{"overlaps by 24 %, and 49 mm off",
             {floor, {at(-2.26, 0, 0.03), 1, 1}, {at(0, 1, -0.049), 0.8, 0.8}},
             2},
        Case{"neighbours in one plane, a strip of two voxels",
             {{at(0.5, 0.5, 0.01), 1, 1}, {at(1.5, 0.5, 0.01), 1, 1}, {at(0.5, 1.02, 0.01), 1, 0.04}},
             0},
        Case{"the sides of a thin wall", {{at(0, 0, 0.02), 1, 1}, {at(0, 0, 0, std::numbers::pi), 1, 1}}, 0},
        Case{"a board over a hole", {holed, {at(0, 0, 0.04), 0.6, 0.6}}, 0},
        Case{"and one over floor", {holed, {at(0, 0, 0.04), 0.6, 0.6}, {at(1, 0, 0.04), 0.6, 0.4}}, 1},
        Case{"leans by 16°", {{at(0, 0, 0), 4, 4}, {at(0, 0, 0, 16 * deg), 0.2, 0.4}}, 0},
        // Near up to 29 cm to both sides: 58 % of the one, 14 % of the other.
        Case{"leans by 10°",
             {{at(0, 0, 0), 4, 4}, {at(0, -1, 0, 10 * deg), 1, 1}, {at(0, 1, 0, 10 * deg), 4, 0.5}},
             1}}) {
    SurfaceStore store(d);
    for (const Sheet& sheet : sheets) add(store, sheet);
    EXPECT_EQ(double_layers(store).size(), layers) << what;
  }
}

}  // namespace
}  // namespace octosurf::surfaces
