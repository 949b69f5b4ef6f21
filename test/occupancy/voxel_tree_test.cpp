// The octree against a map of voxels, and its memory against OctoMap's.
#include "occupancy/voxel_tree.hpp"

#include "occupancy/octomap_twin.hpp"
#include "support/random_scans.hpp"

#include <malloc.h>

namespace octosurf::occupancy {
namespace {

constexpr OccupancyModel model{0.85F, -0.4F, -2, 3.5F, 0};

struct TwinVoxel {
  float log_odds = 0;
  bool point = false;
};
using Twin = std::map<std::uint64_t, TwinVoxel>;  // by Morton index

geometry::VoxelKey key_of(std::uint64_t m) {
  return {static_cast<std::uint16_t>(geometry::compact_bits(m)),
          static_cast<std::uint16_t>(geometry::compact_bits(m >> 1)),
          static_cast<std::uint16_t>(geometry::compact_bits(m >> 2))};
}

/// Checks what it is told against the twin.
struct TwinPolicy {
  Twin& twin;
  std::mt19937_64& rng;
  std::set<std::uint64_t> kept_keys, vanished_keys;

  bool keep(const VoxelPayload& payload, geometry::VoxelKey key) {
    EXPECT_EQ(payload.surface, test::morton(key) & 0xffffff) << "a payload has left its voxel";
    return rng() % 3 == 0 && kept_keys.insert(test::morton(key)).second;
  }
  void vanished(const VoxelPayload& payload, geometry::VoxelKey key) {
    EXPECT_EQ(payload.surface, test::morton(key) & 0xffffff);
    vanished_keys.insert(test::morton(key));
  }
  void hit(VoxelPayload& payload, geometry::VoxelKey key) {
    EXPECT_EQ(payload.has_point(), twin[test::morton(key)].point);
    payload.range_class = 3;
    payload.surface = test::morton(key) & 0xffffff;
  }
};

struct Masks {
  std::array<std::uint64_t, 8> misses{}, hits{};
};

/// The twin's update, voxel by voxel, and what the tree said about it.
void update_twin(Twin& twin, const std::map<std::uint64_t, Masks>& scan, const TwinPolicy& policy) {
  for (const auto& [block, masks] : scan)
    for (unsigned i = 0; i < 512; ++i) {
      const std::uint64_t m = block << 9 | i;
      const bool hit = masks.hits[i / 64] >> (i % 64) & 1, miss = masks.misses[i / 64] >> (i % 64) & 1;
      if (!hit && (!miss || policy.kept_keys.contains(m))) continue;
      TwinVoxel& voxel = twin[m];
      voxel.log_odds =
          std::clamp(voxel.log_odds + (hit ? model.hit : model.miss), model.clamp_min, model.clamp_max);
      const bool occupied = voxel.log_odds >= model.occupied;
      EXPECT_EQ(policy.vanished_keys.contains(m), !hit && voxel.point && !occupied);
      voxel.point = occupied && (voxel.point || hit);
    }
}

/// Looks at every voxel below; whether any is occupied, and `without_point` likewise.
bool expect_marked(const VoxelTree& tree, const VoxelTree::Node& node, bool& without_point) {
  bool occupied = false;
  if (node.has_children()) {
    for (unsigned c = 0; c < 8; ++c) occupied |= expect_marked(tree, node.child(c), without_point);
  } else if (node.exists() && tree.occupied(node.log_odds())) {
    occupied = true;
    without_point |= node.payload() == nullptr;
  }
  if (node.level() >= VoxelTree::brick_level) {
    EXPECT_EQ(node.may_be_occupied(), occupied) << node.level();
  }
  return occupied;
}

void compare(VoxelTree& tree, const Twin& twin) {
  bool without_point = false;
  expect_marked(tree, tree.root(), without_point);
  EXPECT_EQ(without_point, tree.occupied_without_points());
  std::size_t points = 0, known = 0;
  for (const auto& [m, voxel] : twin) {
    const VoxelTree::Lookup found = tree.find(key_of(m));
    ASSERT_TRUE(found.known);
    ASSERT_EQ(found.log_odds, voxel.log_odds);
    ASSERT_EQ(found.payload != nullptr, voxel.point);
    points += voxel.point;
  }
  std::size_t visited = 0;
  std::uint64_t last = 0;
  tree.visit_points({}, VoxelTree::top_level,
                    [&](const VoxelPayload& payload, geometry::VoxelKey key, PayloadPlace, float log_odds) {
                      EXPECT_EQ(log_odds, tree.find(key).log_odds);
                      EXPECT_EQ(payload.surface, test::morton(key) & 0xffffff);
                      EXPECT_TRUE(visited == 0 || test::morton(key) > last);
                      last = test::morton(key);
                      ++visited;
                    });
  EXPECT_EQ(visited, points);
  tree.visit_leaves([&](const VoxelTree::Node& leaf, geometry::VoxelKey) {
    known += std::size_t{1} << (3 * leaf.level());
  });
  EXPECT_EQ(known, twin.size());
}

/// A scan in a corner of 2×2×2 blocks: whole cubes of misses, so that the tree divides and prunes.
std::map<std::uint64_t, Masks> random_scan(std::mt19937_64& rng) {
  std::map<std::uint64_t, Masks> scan;
  const std::uint64_t base = geometry::morton_of(4096, 4100, 4090) & ~std::uint64_t{7};
  for (std::uint64_t b = 0; b < 8; ++b) {
    Masks masks;
    for (unsigned w = 0; w < 8; ++w) {
      masks.misses[w] = rng() % 2 ? ~std::uint64_t{0} : rng();
      masks.hits[w] = rng() % 4 ? 0 : rng() & rng() & rng();
      masks.misses[w] &= ~masks.hits[w];
    }
    if (rng() % 4 != 0) scan[base + b] = masks;
  }
  return scan;
}

TEST(VoxelTree, EqualsAMapOfVoxels) {
  std::mt19937_64 rng(test::seed());
  VoxelTree tree(model);
  Twin twin;
  EXPECT_TRUE(tree.empty());
  for (int round = 0; round < 60; ++round) {
    std::map<std::uint64_t, Masks> scan = random_scan(rng);
    std::vector<detail::TouchedBlock> blocks;
    for (auto& [block, masks] : scan) {
      bool hit = false;
      for (const std::uint64_t w : masks.hits) hit |= w != 0;
      blocks.push_back({block, masks.misses.data(), masks.hits.data(), hit});
    }
    TwinPolicy policy{twin, rng, {}, {}};
    tree.apply(blocks, policy);
    update_twin(twin, scan, policy);
    compare(tree, twin);
  }
}

TEST(VoxelTree, LeavesSetOneByOneAreThere) {
  VoxelTree tree(model);
  tree.set_leaf({32768, 32768, 32768}, 5, -1);
  tree.set_leaf({32776, 32768, 32768}, 1, 2);
  tree.make_payload({32777, 32769, 32769}).surface = 7;
  EXPECT_EQ(tree.find({32799, 32799, 32799}).log_odds, -1);
  EXPECT_EQ(tree.find({32777, 32768, 32769}).log_odds, 2);
  EXPECT_EQ(tree.find({32777, 32769, 32769}).payload->surface, 7U);
  EXPECT_EQ(tree.find({32778, 32768, 32768}).log_odds, -1);
  EXPECT_FALSE(tree.find({32800, 32768, 32768}).known);
  tree.set_leaf({32768, 32768, 32768}, 5, 1);  // replaces all below
  EXPECT_EQ(tree.find({32777, 32769, 32769}).payload, nullptr);
  EXPECT_EQ(tree.find({32777, 32769, 32769}).level, 5);
}

TEST(VoxelTree, MarksWhatIsOccupiedOfLeavesThatWereSet) {
  std::mt19937_64 rng(test::seed());
  for (int round = 0; round < 40; ++round) {
    VoxelTree tree(model);
    for (int i = 0; i < 60; ++i) {
      const auto at = [&rng] { return static_cast<std::uint16_t>(32768 + rng() % 128); };
      const int level = static_cast<int>(rng() % 4);
      const auto corner = [level](std::uint16_t k) {
        return static_cast<std::uint16_t>(k >> level << level);
      };
      const geometry::VoxelKey key{corner(at()), corner(at()), corner(at())};
      const bool occupied = rng() % 4 == 0;
      tree.set_leaf(key, level, occupied ? 1 : -1);
      if (level == 0 && occupied && (round % 2 == 0 || rng() % 8 != 0))
        tree.make_payload(key).range_class = 1;
    }
    bool without_point = false;
    const std::shared_ptr<const VoxelTree> shared = tree.share();
    expect_marked(*shared, shared->root(), without_point);
    EXPECT_EQ(without_point, shared->occupied_without_points());
  }
}

/// Bytes of heap that `make()`'s result holds.
template <class Make>
double heap_of(const Make& make) {
  const auto in_use = [] { return static_cast<double>(mallinfo2().uordblks + mallinfo2().hblkhd); };
  const double before = in_use();
  const auto kept = make();
  return in_use() - before;
}

TEST(VoxelTree, TakesNoMoreHeapThanOctomapsTree) {
  if (test::sanitized) GTEST_SKIP() << "the sanitizer's malloc tells nothing";
  std::mt19937_64 rng = test::rng();
  std::vector<Scan> scans;
  for (int i = 0; i < 6; ++i) scans.push_back(test::room_scan(rng, 8000, {1.6, 1.2, 1.1}));
  for (const double resolution : {0.02, 0.05}) {
    const OccupancyParameters parameters = test::with_resolution(resolution);
    const double theirs = heap_of([&] {
      auto tree = std::make_unique<octomap::OcTree>(resolution);
      for (const Scan& scan : scans) test::insert_scan(*tree, scan, -1);
      malloc_trim(0);
      return tree;
    });
    OccupancyMap map(parameters);
    for (const Scan& scan : scans) test::insert(map, scan, std::numeric_limits<double>::infinity());
    const auto parts = test::parts_of(map);
    // Read back, it holds no scratch of scans.
    const double ours = heap_of([&] {
      auto read_back = std::make_unique<OccupancyMap>(parameters);
      for (const auto& [path, nodes] : parts) read_back->read_part(path, nodes, "here");
      return read_back;
    });
    EXPECT_LE(ours, theirs);
    EXPECT_LE(static_cast<double>(map.size().bytes), ours) << ours << " of heap, OctoMap " << theirs;
    RecordProperty("ours_" + std::to_string(resolution), std::to_string(ours));
    RecordProperty("octomaps_" + std::to_string(resolution), std::to_string(theirs));
  }
}

// What is taken back is as it was, to the last bit and for whoever goes on from there.

TEST(OctreeRollBack, IsAsIfNothingHadBeen) {
  OccupancyMap map(test::with_resolution(0.05)), without(test::with_resolution(0.05));
  auto rng = test::rng();
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  for (int i = 0; i < 12; ++i) {
    const Scan scan = test::room_scan(rng, 1500, {1.1 + uniform(rng), 1.2, 0.8 + uniform(rng)});
    const Scan other = test::room_scan(rng, 1500, {0.9 + uniform(rng), 1.0 + uniform(rng), 0.7});
    const std::string before = test::bytes_of(map);
    const OccupancyMap::Size size = map.size();
    const OccupancyView held = map.share();
    const test::Voxels as_held = test::voxels_of(held);
    map.begin_changes();
    test::insert(map, other);
    map.for_each_point([&](const VoxelPoint& p) { map.assign(p, p.key.x % 7); });
    ASSERT_NE(test::bytes_of(map), before);
    const OccupancyView of_changes = map.share();
    const test::Voxels as_changed = test::voxels_of(of_changes);
    map.roll_back();
    ASSERT_EQ(test::bytes_of(map), before);
    EXPECT_EQ(map.size().nodes, size.nodes);
    EXPECT_EQ(map.bytes(), size.bytes);
    map.begin_changes();
    test::insert(map, scan);
    map.commit();
    test::insert(without, scan);
    ASSERT_EQ(test::bytes_of(map), test::bytes_of(without)) << "goes on as another one";
    ASSERT_EQ(test::voxels_of(held), as_held);
    ASSERT_EQ(test::voxels_of(of_changes), as_changed);
  }
}

}  // namespace
}  // namespace octosurf::occupancy
