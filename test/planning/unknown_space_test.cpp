// Space that nobody saw: against each voxel with its neighbours, and what it keeps feet and regions off.
#include "planning/unknown_space.hpp"

#include "support/painted_octree.hpp"
#include "support/testing.hpp"

#include <octosurf/contact.hpp>

namespace octosurf::planning {
namespace {

constexpr double voxel_m = 0.02;
using Voxel = std::array<int, 3>;

Eigen::Vector3d centre_of(int x, int y, int z) {
  return voxel_m * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
}

bool in_unknown_cube(const OccupancyView& octree, int x, int y, int z) {
  const auto unknown = [&](int i, int j, int k) {
    return octree.at(centre_of(i, j, k)).state == OccupancyView::State::unknown;
  };
  const auto all_unknown = [&](int i, int j, int k) {
    for (int n = 0; n < 27; ++n)
      if (!unknown(i + n % 3, j + n / 3 % 3, k + n / 9)) return false;
    return true;
  };
  for (int n = 0; n < 27; ++n)
    if (all_unknown(x - n % 3, y - n / 3 % 3, z - n / 9)) return true;
  return false;
}

// Longer than a machine word along x, below and above zero; sparse, so that some cubes of 3³ are left.
TEST(UnknownSpace, IsEachVoxelOfUnknownCubes) {
  std::mt19937_64 random(test::seed());
  for (const int share : {8, 40}) {
    test::PaintedOctree octree(voxel_m);
    for (int x = -50; x < 50; ++x)
      for (int y = -9; y < 9; ++y)
        for (int z = -9; z < 9; ++z)
          if (random() % static_cast<unsigned>(share) == 0) octree.free(x, y, z);
    octree.free(-16, -8, 0, 3);
    octree.free(16, 0, -8, 2);
    const OccupancyView view = octree.view();
    std::set<Voxel> expected, found;
    for (int x = -45; x < 45; ++x)
      for (int y = -7; y < 7; ++y)
        for (int z = -6; z < 7; ++z)
          if (in_unknown_cube(view, x, y, z)) expected.insert({x, y, z});
    const Eigen::AlignedBox3d box(centre_of(-45, -7, -6), centre_of(44, 6, 6));
    for_each_unknown(view, box, [&](const Eigen::Vector3d& centre) {
      const Eigen::Array3i at = (centre / voxel_m).array().floor().cast<int>();
      EXPECT_TRUE(found.insert({at.x(), at.y(), at.z()}).second);
    });
    EXPECT_EQ(found, expected);
    UnknownVoxels kept(view);
    for (int again = 0; again < 2; ++again) {
      std::set<Voxel> of_kept;
      kept.for_each(box, [&](const Eigen::Vector3d& centre) {
        const Eigen::Array3i at = (centre / voxel_m).array().floor().cast<int>();
        EXPECT_TRUE(of_kept.insert({at.x(), at.y(), at.z()}).second);
      });
      EXPECT_EQ(of_kept, expected);
    }
    EXPECT_GT(found.size(), 100U);
  }
}

/// 1 m² of floor of which the right half was seen from afar, and nothing over it.
struct HalfSeen {
  test::PaintedOctree octree{voxel_m};
  Surface floor;
  ContactLimits limits;

  HalfSeen() {
    floor.id = 1;
    floor.resolution = voxel_m;
    floor.T_map_surface.translation().z() = voxel_m / 2;
    floor.plane.offset = voxel_m / 2;
    floor.polygons = {{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {}}};
    floor.area_m2 = 1;
    for (int x = 0; x < 50; ++x)
      for (int y = 0; y < 50; ++y) {
        octree.occupy(x, y, 0, 2, 1);
        for (int z = 1; z < 10; ++z)
          if (x < 25) octree.free(x, y, z);
      }
    limits.unknown_to_m = 0.1;
  }
};

TEST(UnknownSpace, IsNoPlaceForAFoot) {
  HalfSeen half;
  const OccupancyView octree = half.octree.view();
  const ContactShape foot = ContactShape::rectangle(0.2, 0.1);
  const auto hold = [&](double u) {
    return foothold(half.floor, foot, {u, 0.5, 0}, 0, half.limits, &octree);
  };
  EXPECT_TRUE(hold(0.39).accepted);
  EXPECT_EQ(hold(0.41).refused, ContactRefusal::unknown);
  EXPECT_EQ(hold(0.7).refused, ContactRefusal::unknown);
  const ContactRegion region = contact_region(half.floor, foot, 0, half.limits, &octree);
  EXPECT_NEAR(region.area_m2, 0.3 * 0.9, 2.4 * 0.015);
  Surface unseen = half.floor;
  unseen.polygons = {{{{0.6, 0}, {1, 0}, {1, 1}, {0.6, 1}}, {}}};
  const ContactRegion none = contact_region(unseen, foot, 0, half.limits, &octree);
  EXPECT_EQ(none.refused, std::vector{ContactRefusal::unknown});
  half.limits.unknown_to_m = 0;
  EXPECT_TRUE(hold(0.7).accepted);
}

}  // namespace
}  // namespace octosurf::planning
