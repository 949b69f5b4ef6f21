// Look-ups by place and by plane against a walk over all surfaces.
#include "surfaces/surface_store.hpp"

#include "surfaces/blobs.hpp"

namespace octosurf::surfaces {
namespace {

using test::d;

struct Filled {
  SurfaceStore store{d};
  std::map<SurfaceId, std::vector<Inlier>> inliers;
};

void add_surface(Filled& filled, std::mt19937_64& rng, double reach) {
  const Eigen::Isometry3d pose = test::random_pose(rng, reach);
  SurfaceModel& surface = filled.store.create(test::plane_of(pose), pose.translation());
  for (const Inlier& i : test::voxels_of(test::random_blob(rng, 0.3, 0.05), pose, d, 0.3, 0.004, rng)) {
    filled.store.add(surface, i);
    filled.inliers[surface.id()].push_back(i);
  }
}

/// `edge`: of the blocks or regions, voxels.
std::vector<SurfaceId> slowly_near(const Filled& filled, geometry::VoxelKey key, int reach, int edge) {
  std::vector<SurfaceId> ids;
  const auto met = [&](std::uint16_t k, std::uint16_t centre) {
    return k / edge >= (centre - reach) / edge && k / edge <= (centre + reach) / edge;
  };
  for (const auto& [id, inliers] : filled.inliers)
    if (std::any_of(inliers.begin(), inliers.end(), [&](const Inlier& i) {
          return met(i.key.x, key.x) && met(i.key.y, key.y) && met(i.key.z, key.z);
        }))
      ids.push_back(id);
  return ids;
}

void expect_found(const Filled& filled, std::mt19937_64& rng) {
  for (const auto& [id, inliers] : filled.inliers)
    for (std::size_t i = 0; i < inliers.size(); i += 1 + inliers.size() / 10) {
      geometry::VoxelKey key = inliers[i].key;
      key.x = static_cast<std::uint16_t>(key.x + rng() % 31 - 15);
      key.z = static_cast<std::uint16_t>(key.z + rng() % 31 - 15);
      for (const int reach : {0, 2, 9}) {
        const SurfaceStore::Ids found = filled.store.near(key, reach);
        EXPECT_EQ(std::vector<SurfaceId>(found.begin(), found.end()), slowly_near(filled, key, reach, 8));
        const SurfaceStore::Ids in_regions = filled.store.in_regions_near(key, reach);
        EXPECT_EQ(std::vector<SurfaceId>(in_regions.begin(), in_regions.end()),
                  slowly_near(filled, key, reach, 64));
      }
    }
}

TEST(SurfaceStore, FindsByPlaceUnderChurn) {
  std::mt19937_64 rng = test::rng();
  Filled filled;
  for (int i = 0; i < 12; ++i) add_surface(filled, rng, 0.5);
  expect_found(filled, rng);
  for (int round = 0; round < 4; ++round) {
    for (auto& [id, inliers] : filled.inliers) {
      SurfaceModel& surface = *filled.store.find(id);
      std::shuffle(inliers.begin(), inliers.end(), rng);
      const std::size_t left = id % 4 == 0 ? 0 : inliers.size() / 2;
      while (inliers.size() > left) {
        ASSERT_TRUE(filled.store.remove(surface, inliers.back().key, inliers.back().position));
        inliers.pop_back();
      }
    }
    for (auto at = filled.inliers.begin(); at != filled.inliers.end();)
      if (at->second.empty()) {
        filled.store.erase(at->first);
        EXPECT_EQ(filled.store.find(at->first), nullptr);
        at = filled.inliers.erase(at);
      } else {
        ++at;
      }
    EXPECT_EQ(filled.store.size(), filled.inliers.size());
    expect_found(filled, rng);
    add_surface(filled, rng, 0.5);
  }
}

TEST(SurfaceStore, IdsRiseAndAreNeverUsedAgain) {
  SurfaceStore store(d);
  const SurfaceId first = store.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0}).id();
  const SurfaceId second = store.create({Eigen::Vector3d::UnitX(), 0}, {0, 0, 0}).id();
  EXPECT_EQ(first, 1U);
  EXPECT_EQ(second, 2U);
  store.erase(second);
  EXPECT_EQ(store.create({Eigen::Vector3d::UnitY(), 0}, {0, 0, 0}).id(), 3U);
  EXPECT_EQ(store.next_id(), 4U);
  store.set_next_id(0xffffff);
  EXPECT_EQ(store.create({Eigen::Vector3d::UnitY(), 0}, {0, 0, 0}).id(), 0xffffffU);
  EXPECT_ANY_THROW(store.create({Eigen::Vector3d::UnitY(), 0}, {0, 0, 0}));
}

}  // namespace
}  // namespace octosurf::surfaces
