// What is looked up by block, beside the same looked up voxel by voxel.
#include "detection/label_blocks.hpp"
#include "detection/voxel_blocks.hpp"
#include "support/pending_points.hpp"
#include "support/round_scene.hpp"

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

int distance(geometry::VoxelKey a, geometry::VoxelKey b) {
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

Scan corner(std::mt19937_64& rng) {
  test::Scene scene;
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  return test::camera_scan(scene, test::look_at({0.7, 0.8, 0.9}, {0.3, 0.2, 0.2}), rng);
}

TEST(LabelBlocks, FindWhatAWalkOverAllFinds) {
  std::mt19937_64 rng = test::rng();
  const test::PendingPoints points({corner(rng)}, Parameters{});
  std::vector<PointId> labelled, context;
  for (const PointId i : points.all) (rng() % 3 == 0 ? context : labelled).push_back(i);
  const Readings readings(points.ledger,
                          {.points = labelled, .may_join = {}, .context = context, .boundary = {}});
  const auto size = static_cast<Index>(readings.size_with_context());
  ASSERT_EQ(size, points.all.size());
  std::vector<Label> labels(size);
  std::vector<bool> wanted(size);
  for (Index i = 0; i < size; ++i) {
    labels[i] = static_cast<Label>(rng() % 3);
    wanted[i] = rng() % 2 == 0;
  }
  for (const int reach : {1, 4, 11}) {
    std::vector<std::set<std::pair<Index, Label>>> near(size);  // who, and whose group is met
    LabelBlocks(readings, labels, wanted).for_each_block(reach, [&](const auto& groups, const auto& blocks) {
      for (const LabelBlocks::Group& group : groups)
        for (const Index i : group.members) {
          EXPECT_EQ(readings.is_context(i), group.context);
          for (const LabelBlocks::Near& block : blocks)
            for (const LabelBlocks::Group& other : *block.groups) {
              const LabelBlocks::BoxMask part = block.within(readings[i].key, reach);
              const std::size_t before = near[i].size();
              part.for_each_of(other, [&](Index j) { near[i].emplace(j, other.label); });
              EXPECT_EQ(part.any_of(other), near[i].size() > before);
            }
        }
    });
    for (int trial = 0; trial < 100; ++trial) {
      const auto i = static_cast<Index>(rng() % size);
      std::set<std::pair<Index, Label>> expected;
      for (Index j = 0; j < size; ++j)
        if (wanted[i] && wanted[j] && distance(readings[i].key, readings[j].key) <= reach)
          expected.emplace(j, labels[j]);
      EXPECT_EQ(near[i], expected) << reach;
    }
  }
}

TEST(VoxelBlocks, WidenedAreThoseWithinReach) {
  std::mt19937_64 rng = test::rng();
  const int edge = 4, voxels = 5, reach = 2;
  const VoxelBlocks blocks(edge);
  std::vector<VoxelBlocks::Place> places;
  std::set<VoxelBlocks::Place> expected;
  const auto key_at = [](int x, int y, int z) {
    return geometry::VoxelKey{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                              static_cast<std::uint16_t>(z)};
  };
  for (int k = 0; k < 20; ++k) {  // near the corner where keys end
    const int x = static_cast<int>(rng() % 40), y = 65535 - static_cast<int>(rng() % 40), z = 70;
    places.push_back(blocks.of(key_at(x, y, z)));
    for (int dz = -reach; dz <= reach; ++dz)
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
          const int bx = x + dx * edge, by = y + dy * edge;
          if (bx >= 0 && by <= 65535) expected.insert(blocks.of(key_at(bx, by, z + dz * edge)));
        }
  }
  const std::vector<VoxelBlocks::Place> found = blocks.widened(places, voxels);
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
  EXPECT_EQ(std::set(found.begin(), found.end()), expected);
  EXPECT_EQ(found.size(), expected.size());
}

TEST(VoxelBlocks, HoldEachPointOnceUpToTheOctreesEnd) {
  std::mt19937_64 rng = test::rng();
  const double d = Parameters{}.occupancy.resolution;
  // One corner of the cloud at the last voxels of the octree, which an edge of seven does not divide.
  Scan scan;
  scan.T_map_sensor.translation() = Eigen::Vector3d::Constant((32768 - 60) * d);
  for (int k = 0; k < 400; ++k) {
    const auto part = [&] { return static_cast<float>((20.5 + static_cast<double>(rng() % 39)) * d); };
    scan.points.emplace_back(part(), part(), part());
  }
  scan.points.emplace_back(Eigen::Vector3f::Constant(static_cast<float>(59.5 * d)));
  const test::PendingPoints points({scan}, Parameters{});
  std::multiset<std::uint64_t> all, met;
  std::set<VoxelBlocks::Place> places;
  const VoxelBlocks blocks(7);
  points.state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
    all.insert(p.key.packed());
    places.insert(blocks.of(p.key));
  });
  ASSERT_EQ(*all.rbegin(), (geometry::VoxelKey{65535, 65535, 65535}.packed()));
  for (const VoxelBlocks::Place place : places)
    blocks.for_each_point(points.ledger.window, place,
                          [&](PointId i) { met.insert(points.ledger.window[i].key.packed()); });
  EXPECT_EQ(met, all);
}

}  // namespace
}  // namespace octosurf::detection
