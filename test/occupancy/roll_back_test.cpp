// What is taken back is as it was, to the last bit and for whoever goes on from there.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octree_bytes.hpp"
#include "occupancy/pool.hpp"
#include "support/random_scans.hpp"
#include "support/testing.hpp"

namespace octosurf::occupancy {
namespace {

/// A pool of small chunks beside a slow twin: all objects in use by index, and what there was at the last
/// begin_changes().
class PoolAndTwin {
 public:
  void change(std::mt19937_64& rng) {
    switch (rng() % 8) {
      case 0:
      case 1:
      case 2: {
        const std::uint32_t index = pool_.make();
        EXPECT_TRUE(values_.emplace(index, 0U).second) << "handed out twice";
        EXPECT_EQ(pool_[index], 0U);
        break;
      }
      case 3:
        if (!values_.empty()) {
          const auto any = std::next(values_.begin(), static_cast<long>(rng() % values_.size()));
          pool_.release(any->first);
          values_.erase(any);
        }
        break;
      case 4:
        if (rng() % 8 == 0) {
          views_.push_back(pool_.share());
          seen_.push_back(values_);
        }
        break;
      default:
        if (!values_.empty()) {
          const auto any = std::next(values_.begin(), static_cast<long>(rng() % values_.size()));
          pool_.writable(any->first) = any->second = static_cast<unsigned>(rng());
        }
    }
  }
  void begin_changes() {
    pool_.begin_changes();
    before_ = values_;
    bytes_before_ = pool_.bytes();
  }
  void end_changes(bool back) {
    back ? pool_.roll_back() : pool_.commit();
    if (!back) return;
    values_ = before_;
    EXPECT_EQ(pool_.bytes(), bytes_before_);
  }
  void expect_equal() const {
    for (const auto& [index, value] : values_) ASSERT_EQ(pool_[index], value) << index;
    for (std::size_t view = 0; view < views_.size(); ++view)
      for (const auto& [index, value] : seen_[view]) ASSERT_EQ(views_[view][index], value) << "of a view";
  }

 private:
  using Values = std::map<std::uint32_t, unsigned>;
  Pool<unsigned, 3> pool_;
  Values values_, before_;
  std::size_t bytes_before_ = 0;
  std::vector<Pool<unsigned, 3>> views_;
  std::vector<Values> seen_;
};

TEST(PoolRollBack, EqualsATwinThatCopiesEverything) {
  for (const std::uint64_t seed : test::seeds(20)) {
    std::mt19937_64 rng(seed);
    PoolAndTwin both;
    for (int round = 0; round < 40; ++round) {
      for (std::size_t n = rng() % 40; n > 0; --n) both.change(rng);
      both.begin_changes();
      for (std::size_t n = rng() % 120; n > 0; --n) both.change(rng);
      both.end_changes(rng() % 2 == 0);
      both.expect_equal();
    }
  }
}

TEST(OctreeRollBack, IsAsIfNothingHadBeen) {
  OccupancyMap map(test::with_resolution(0.05)), without(test::with_resolution(0.05));
  auto rng = test::rng();
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  for (int i = 0; i < 12; ++i) {
    const Scan scan = test::room_scan(rng, 1500, {1.1 + uniform(rng), 1.2, 0.8 + uniform(rng)});
    const Scan other = test::room_scan(rng, 1500, {0.9 + uniform(rng), 1.0 + uniform(rng), 0.7});
    const std::string before = test::bytes_of(map);
    const OccupancyMap::Size size = map.size();
    map.begin_changes();
    test::insert(map, other);
    map.for_each_point([&](const VoxelPoint& p) { map.assign(p, p.key.x % 7); });
    ASSERT_NE(test::bytes_of(map), before);
    map.roll_back();
    ASSERT_EQ(test::bytes_of(map), before);
    EXPECT_EQ(map.size().nodes, size.nodes);
    EXPECT_EQ(map.bytes(), size.bytes);
    map.begin_changes();
    test::insert(map, scan);
    map.commit();
    test::insert(without, scan);
    ASSERT_EQ(test::bytes_of(map), test::bytes_of(without)) << "goes on as another one";
  }
}

}  // namespace
}  // namespace octosurf::occupancy
