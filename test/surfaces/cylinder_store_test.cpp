#include "surfaces/cylinder_store.hpp"

#include <gmock/gmock.h>

namespace octosurf::surfaces {
namespace {

using ::testing::ElementsAre;

const geometry::CylinderShape upright_pole{{1, 2, 0}, {0, 0, 1}, 0.1};

Inlier inlier(std::uint16_t z, double angle = 0) {
  return {{0, 0, z},
          1,
          Eigen::Vector3d(1 + 0.1 * std::cos(angle), 2 + 0.1 * std::sin(angle), 0.02 * z).cast<float>()};
}

TEST(CylinderStore, AVoxelSupportsOneCylinder) {
  CylinderStore store;
  CylinderModel& a = store.create(upright_pole);
  CylinderModel& b = store.create(upright_pole);
  store.add(a, inlier(1));
  store.add(a, inlier(2));
  store.add(b, inlier(2));
  EXPECT_EQ(store.owner(inlier(1).key), a.id);
  EXPECT_EQ(store.owner(inlier(2).key), b.id);
  EXPECT_EQ(store.owner(inlier(3).key), 0U);
  EXPECT_EQ(a.inliers.size(), 1U);
  store.release(inlier(2).key);
  store.release(inlier(3).key);
  EXPECT_EQ(store.owner(inlier(2).key), 0U);
  EXPECT_TRUE(b.inliers.empty());
  const CylinderId first = a.id;
  store.erase(first);
  EXPECT_EQ(store.find(first), nullptr);
  EXPECT_EQ(store.owner(inlier(1).key), 0U) << "free for others";
  EXPECT_EQ(store.create(upright_pole).id, first + 2) << "ids are never reused";
}

TEST(CylinderStore, PublishesAnewWhatWasTouched) {
  CylinderStore store;
  CylinderModel& a = store.create(upright_pole);
  CylinderModel& b = store.create(upright_pole);
  for (std::uint16_t z = 0; z < 10; ++z) {
    store.add(a, inlier(z, 0.1 * z));
    store.add(b, inlier(static_cast<std::uint16_t>(z + 20), 0.1 * z));
  }
  EXPECT_THAT(store.touched(), ElementsAre(a.id, b.id));
  const auto first = store.publish(7);
  ASSERT_EQ(first.size(), 2U);
  EXPECT_EQ(first[0]->revision, 7U);
  EXPECT_EQ(first[0]->inliers, 10U);
  EXPECT_NEAR(first[0]->length_m, 0.18, 1e-6);
  EXPECT_NEAR(first[0]->axis_point.z(), 0.09, 1e-6) << "in the middle";
  EXPECT_NEAR(first[0]->span_rad, 0.9, 1e-6);
  EXPECT_NEAR(first[0]->start.x(), 1, 1e-6);
  EXPECT_LT(first[0]->rms_m, 1e-6);
  EXPECT_TRUE(store.touched().empty());
  EXPECT_EQ(store.publish(8), first) << "nothing has changed";
  store.release(inlier(9).key);
  const auto third = store.publish(9);
  EXPECT_EQ(third[1], first[1]);
  EXPECT_EQ(third[0]->inliers, 9U);
  EXPECT_EQ(third[0]->revision, 9U);
  EXPECT_NEAR(third[0]->length_m, 0.16, 1e-6);
  EXPECT_EQ(first[0]->inliers, 10U) << "what was published never changes";
}

TEST(CylinderStore, ACloserViewMovesAPoint) {
  CylinderStore store;
  CylinderModel& a = store.create(upright_pole);
  store.add(a, inlier(1));
  store.publish(1);
  Inlier closer = inlier(1);
  closer.position.z() += 0.005F;
  store.move(closer);
  store.move(inlier(2));
  EXPECT_EQ(a.inliers.size(), 1U);
  EXPECT_EQ(a.inliers.begin()->second.position, closer.position);
  EXPECT_THAT(store.touched(), ElementsAre(a.id));
}

}  // namespace
}  // namespace octosurf::surfaces
