// Two octrees into one, against maps of voxels.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octree_bytes.hpp"
#include "support/random_scans.hpp"

namespace octosurf::occupancy {
namespace {

using Values = test::Voxels;
using Points = std::map<geometry::VoxelKey, VoxelPoint>;

OccupancyParameters coarse(double occupied = 0.5) { return test::with_resolution(0.05, occupied); }

/// Scans of a room, or of another like it; its points belong to surfaces at random.
OccupancyMap random_map(std::mt19937_64& rng, const OccupancyParameters& parameters) {
  OccupancyMap map(parameters);
  const Eigen::Vector3d size =
      rng() % 2 == 0 ? Eigen::Vector3d(0.8, 0.6, 0.7) : Eigen::Vector3d(0.8, 0.7, 0.5);
  std::uniform_real_distribution<double> from(-0.3, 0.3);  // so that one map's voxels are seen from nearer
  for (auto scans = 1 + rng() % 6; scans > 0; --scans)
    test::insert(map, test::room_scan(rng, 1500, size, {from(rng), from(rng), from(rng)}));
  for (const VoxelPoint& p : test::points_of(map)) map.assign(p.key, static_cast<SurfaceId>(rng() % 9));
  return map;
}

Points points_by_key(const OccupancyMap& map) {
  Points points;
  for (const VoxelPoint& p : test::points_of(map)) points[p.key] = p;
  return points;
}

float log_odds_of(double p) { return static_cast<float>(std::log(p / (1 - p))); }

/// What the two amount to, voxel by voxel.
Values sum_of(const Values& a, const Values& b, const OccupancyParameters& parameters) {
  Values sum = a;
  for (const auto& [key, value] : b) {
    const auto [at, fresh] = sum.try_emplace(key, value);
    if (!fresh)
      at->second = std::clamp(at->second + value, log_odds_of(parameters.clamp_min),
                              log_odds_of(parameters.clamp_max));
  }
  return sum;
}

TEST(MergedOctrees, AddUpVoxelByVoxel) {
  for (const double occupied : {0.5, 0.7, 0.4}) {
    std::mt19937_64 rng = test::rng();
    const OccupancyParameters parameters = coarse(occupied);
    OccupancyMap a = random_map(rng, parameters), b = random_map(rng, parameters);
    const Values sum = sum_of(test::voxels_of(a.share()), test::voxels_of(b.share()), parameters);
    const Points points_a = points_by_key(a), points_b = points_by_key(b);
    const OccupancyMap::Merged merged = a.merge(b);
    EXPECT_EQ(test::voxels_of(a.share()), sum);

    // Whose point stays, voxel by voxel.
    const Points points = points_by_key(a);
    std::size_t appeared = 0, vanished = 0, refined = 0;
    for (const auto& [key, value] : sum) {
      const auto of_a = points_a.find(key), of_b = points_b.find(key), now = points.find(key);
      const bool is_occupied = value >= log_odds_of(parameters.occupied);
      ASSERT_EQ(now != points.end(), is_occupied && (of_a != points_a.end() || of_b != points_b.end()));
      vanished += of_a != points_a.end() && !is_occupied;
      if (now == points.end()) continue;
      const bool closer = of_a != points_a.end() && of_b != points_b.end() &&
                          of_b->second.range_class < of_a->second.range_class;
      const bool had = of_a != points_a.end();
      test::expect_same_point(now->second, had && !closer ? of_a->second : of_b->second,
                              had ? of_a->second.surface : 0);
      appeared += !had;
      refined += closer;
    }
    EXPECT_EQ(merged.delta.appeared.size(), appeared);
    EXPECT_EQ(merged.delta.vanished.size(), vanished);
    EXPECT_EQ(merged.delta.refined.size(), refined);
    EXPECT_GT(appeared, 0u);
    EXPECT_GT(refined, 0u);
    ASSERT_EQ(merged.surfaces.size(), appeared);
    for (std::size_t i = 0; i < appeared; ++i)
      EXPECT_EQ(merged.surfaces[i], points_b.at(merged.delta.appeared[i].key).surface);
    for (const VoxelPoint& p : merged.delta.vanished) {
      const VoxelPoint& was = points_a.at(p.key);
      test::expect_same_point(p, was, was.surface);
    }
    for (const OccupancyDelta::Refined& r : merged.delta.refined)
      test::expect_same_point(r.before, points_a.at(r.after.key), r.after.surface);
  }
}

/// Cubes of all sizes up to 16 voxels that overlap, of a few values, in one of 32.
std::vector<OccupancyView::Leaf> random_cubes(std::mt19937_64& rng) {
  std::vector<OccupancyView::Leaf> leaves;
  constexpr std::array<float, 4> values{-2, -1, 0.5F, 3};
  for (int i = 0; i < 60; ++i) {
    OccupancyView::Leaf leaf;
    leaf.level = static_cast<std::uint8_t>(rng() % 5);
    for (std::uint16_t& k : leaf.corner)
      k = static_cast<std::uint16_t>(32768 + ((rng() % 32) >> leaf.level << leaf.level));
    leaf.log_odds = values[rng() % values.size()];
    leaves.push_back(leaf);
  }
  return leaves;
}

TEST(MergedOctrees, AreUndividedWhereAllIsEqual) {
  std::mt19937_64 rng = test::rng();
  for (int world = 0; world < 8; ++world) {
    OccupancyMap a(coarse()), b(coarse());
    a.set_leaves(random_cubes(rng));
    b.set_leaves(random_cubes(rng));
    const Values sum = sum_of(test::voxels_of(a.share()), test::voxels_of(b.share()), coarse());
    OccupancyMap nothing(coarse());
    nothing.merge(a);
    nothing.merge(b);
    EXPECT_EQ(test::voxels_of(nothing.share()), sum);
    std::size_t leaves = 0;
    nothing.share().for_each_leaf([&](std::span<const OccupancyView::Leaf> all) { leaves += all.size(); });
    EXPECT_EQ(nothing.size().leaves, leaves);
  }
}

/// Beside the room, so that points stay occupied.
void add_cubes(OccupancyMap& map, std::mt19937_64& rng) {
  for (OccupancyView::Leaf& leaf : random_cubes(rng)) {
    leaf.corner[0] = static_cast<std::uint16_t>(leaf.corner[0] + 32);
    map.set_leaves({&leaf, 1});
  }
}

TEST(ReplacedOctrees, AreTheOtherVoxelByVoxel) {
  std::mt19937_64 rng = test::rng();
  const float low = log_odds_of(coarse().clamp_min), high = log_odds_of(coarse().clamp_max);
  for (const bool of_bt : {false, true}) {
    OccupancyMap map = random_map(rng, coarse()), other = random_map(rng, coarse());
    add_cubes(map, rng);
    add_cubes(other, rng);
    if (of_bt) other = test::octree_of_file(test::bt_of(other), coarse());
    const Values before = test::voxels_of(map.share());
    Values expected = test::voxels_of(other.share());
    for (auto& [key, value] : expected)
      if (const auto was = before.find(key);
          was != before.end() && (value <= low || value >= high) && (was->second >= 0) == (value >= 0))
        value = was->second;
    const Points points_before = points_by_key(map);
    const OccupancyDelta delta = map.replace(other);
    EXPECT_EQ(test::voxels_of(map.share()), expected);
    const Points points = points_by_key(map);
    std::size_t kept = 0;
    for (const auto& [key, was] : points_before) {
      const auto value = expected.find(key);
      const auto now = points.find(key);
      const bool stays = value != expected.end() && value->second >= 0;
      ASSERT_EQ(now != points.end(), stays);
      if (stays) test::expect_same_point(now->second, was, was.surface);
      kept += stays;
    }
    EXPECT_EQ(delta.vanished.size(), points_before.size() - kept);
    EXPECT_EQ(delta.appeared.size(), points.size() - kept);
    EXPECT_GT(kept, 0U);
    EXPECT_FALSE(delta.vanished.empty() || delta.appeared.empty());
    for (const VoxelPoint& p : delta.vanished)
      test::expect_same_point(p, points_before.at(p.key), points_before.at(p.key).surface);
    for (const VoxelPoint& p : delta.appeared) EXPECT_EQ(points.at(p.key).surface, 0U);
  }
}

/// The rule, voxel by voxel.
TEST(ResampledOctree, KnowsWhatTheOtherKnowsAtItsCentres) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  OccupancyMap from = random_map(rng, coarse());
  add_cubes(from, rng);  // free, and occupied without a point
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = 0.3 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
  T.rotate(
      Eigen::AngleAxisd(3 * uniform(rng), Eigen::Vector3d(uniform(rng), uniform(rng), 1.1).normalized()));
  std::size_t lost = 0;
  OccupancyMap to = OccupancyMap::resampled(from, T, coarse(), lost);
  EXPECT_EQ(lost, 0u);

  Values expected;
  const geometry::VoxelGrid grid(coarse().resolution);
  const Eigen::Isometry3d back = T.inverse();
  // All that is known lies within 4 m of the origin, which has moved by 0.6 m at most.
  constexpr int reach = 4.6 * 20;
  for (int z = -reach; z < reach; ++z)
    for (int y = -reach; y < reach; ++y)
      for (int x = -reach; x < reach; ++x) {
        const Eigen::Vector3d centre = (Eigen::Vector3d(x, y, z).array() + 0.5) * grid.resolution();
        geometry::VoxelKey there;
        ASSERT_TRUE(grid.key_of((back * centre).cast<float>(), there));
        const OccupancyMap::Lookup found = from.at(there);
        if (found.state == OccupancyMap::State::unknown || found.point) continue;
        expected[{static_cast<std::uint16_t>(x + 32768), static_cast<std::uint16_t>(y + 32768),
                  static_cast<std::uint16_t>(z + 32768)}] = found.log_odds;
      }
  Points points;
  Values of_points;
  from.for_each_point([&](const VoxelPoint& p) {
    geometry::VoxelKey key;
    ASSERT_TRUE(grid.key_of((T * p.position.cast<double>()).cast<float>(), key));
    const float log_odds = from.at(p.key).log_odds;
    const auto [at, fresh] = of_points.try_emplace(key, log_odds);
    at->second = std::max(at->second, log_odds);
    const auto [point, first] = points.try_emplace(key, p);
    if (!first && p.range_class < point->second.range_class) point->second = p;
  });
  for (const auto& [key, log_odds] : of_points) expected[key] = log_odds;
  EXPECT_EQ(test::voxels_of(to.share()), expected);
  const Points found = points_by_key(to);
  ASSERT_EQ(found.size(), points.size());
  for (const auto& [key, point] : found) {
    const VoxelPoint& was = points.at(key);
    EXPECT_LT((T * was.position.cast<double>() - point.position.cast<double>()).norm(),
              grid.resolution() / 256);
    EXPECT_GT((T.linear() * was.view.cast<double>()).dot(point.view.cast<double>()), std::cos(0.07));
    EXPECT_EQ(point.range_class, was.range_class);
    EXPECT_EQ(point.surface, was.surface);
  }
}

TEST(ResampledOctree, CountsWhatIsOutside) {
  std::mt19937_64 rng = test::rng();
  OccupancyMap from = random_map(rng, coarse());
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = 32768 * coarse().resolution;  // the octree's edge is in the middle of the room
  std::size_t lost = 0;
  const OccupancyMap to = OccupancyMap::resampled(from, T, coarse(), lost);
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(points_by_key(to).size() + lost, points_by_key(from).size());
}

}  // namespace
}  // namespace octosurf::occupancy
