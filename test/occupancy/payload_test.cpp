// What a voxel with a point carries.
#include "occupancy/payload.hpp"

#include "support/testing.hpp"

namespace octosurf::occupancy {
namespace {

TEST(Payload, PointComesBackWithinHalfAStep) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> inside(0, 1), far(-200, 200);
  for (const double d : {0.005, 0.02, 0.11}) {
    const geometry::VoxelGrid grid(d);
    for (int i = 0; i < 5000; ++i) {
      geometry::VoxelKey key;
      ASSERT_TRUE(grid.key_of(Eigen::Vector3d(far(rng), far(rng), far(rng))
                                  .cwiseMin(30000 * d)
                                  .cwiseMax(-30000 * d)
                                  .cast<float>(),
                              key));
      const Eigen::Vector3d point =
          grid.corner_of(key) + d * Eigen::Vector3d(inside(rng), inside(rng), inside(rng));
      VoxelPayload payload;
      store_point(payload, grid, key, point.cast<float>(), Eigen::Vector3f::Zero());
      ASSERT_TRUE(payload.has_point());
      const Eigen::Vector3f back = load_point(payload, grid, key).cast<float>();
      const double rounding = 4 * std::numeric_limits<float>::epsilon() * point.norm();
      ASSERT_LE((back.cast<double>() - point).cwiseAbs().maxCoeff(), d / 512 + rounding);
      geometry::VoxelKey again;
      ASSERT_TRUE(grid.key_of(back, again));
      if (d > 100 * rounding) {
        ASSERT_EQ(again, key) << "a stored point left its voxel";
      }
    }
  }
}

TEST(Payload, PointOutsideItsVoxelIsDrawnToItsBorder) {
  const geometry::VoxelGrid grid(0.02);
  const geometry::VoxelKey key{40000, 30000, 32768};
  VoxelPayload payload;
  store_point(payload, grid, key, grid.centre_of(key) + Eigen::Vector3f(0.1F, -0.1F, 0),
              Eigen::Vector3f::Zero());
  const Eigen::Vector3d back = load_point(payload, grid, key) - grid.corner_of(key);
  EXPECT_NEAR(back.x(), 0.02, 1e-4);
  EXPECT_NEAR(back.y(), 0, 1e-4);
}

TEST(Payload, ViewIsExactToFourDegrees) {
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<float> gauss;
  const auto check = [](const Eigen::Vector3f& v) {
    const Eigen::Vector3f back = sensing::decode_view(sensing::encode_view(v));
    EXPECT_NEAR(back.norm(), 1, 1e-5);
    EXPECT_LT(sensing::encode_view(v), 1U << 12);
    const double angle = std::acos(std::min(1.0F, back.dot(v.normalized()))) * 180 / std::numbers::pi;
    // Worst in the middle of an octant: half a step of 2/63 along both coordinates is √6/63 at 1/√3.
    EXPECT_LE(angle, 3.9) << v.transpose();
  };
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0)
          check(Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)));
  for (int i = 0; i < 20000; ++i) check({gauss(rng), gauss(rng), gauss(rng)});
}

TEST(Payload, RangeClassIsExactToRootTwo) {
  EXPECT_EQ(sensing::range_class_of(0), 1U);  // 0 would be "no point"
  EXPECT_EQ(sensing::range_class_of(0.25F), 1U);
  EXPECT_EQ(sensing::range_class_of(1e30F), 15U);
  unsigned last = 1;
  for (float r = 0.25F; r < 32; r *= 1.01F) {
    const unsigned c = sensing::range_class_of(r);
    EXPECT_GE(c, last);
    last = c;
    EXPECT_LE(sensing::range_of_class(c), r * std::sqrt(2.0F));
    EXPECT_GE(sensing::range_of_class(c), r / std::sqrt(2.0F));
  }
}

}  // namespace
}  // namespace octosurf::occupancy
