// Views of the octree: what they answer against a list of all voxels, and that nothing that is inserted later
// is seen in them.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octree_bytes.hpp"
#include "occupancy/voxel_tree.hpp"
#include "support/random_scans.hpp"

namespace octosurf::occupancy {
namespace {

constexpr double resolution = 0.1;
using State = OccupancyView::State;

OccupancyParameters parameters(double occupied = 0.5) { return test::with_resolution(resolution, occupied); }

using test::insert;

/// A room around the origin, seen by `scans` scans, surfaces' ids at random.
void fill(OccupancyMap& map, std::mt19937_64& rng, int scans) {
  for (int i = 0; i < scans; ++i) insert(map, test::room_scan(rng, 400, {1.6, 1.2, 0.9}));
  for (const VoxelPoint& p : test::points_of(map)) map.assign(p, static_cast<SurfaceId>(rng() % 5));
}

/// All voxels of a box about the room, one by one, by the map itself.
struct Listed {
  geometry::VoxelKey key;
  Eigen::Vector3d centre;
  State state = State::unknown;
  float log_odds = 0;
  SurfaceId surface = 0;
  Eigen::Vector3d point = centre, view = Eigen::Vector3d::Zero();
};
std::vector<Listed> list_of(const OccupancyMap& map) {
  std::vector<Listed> all;
  constexpr int reach = 22;
  for (int z = -reach; z < reach; ++z)
    for (int y = -reach; y < reach; ++y)
      for (int x = -reach; x < reach; ++x) {
        const auto k = [](int i) { return static_cast<std::uint16_t>(geometry::VoxelGrid::origin + i); };
        Listed v{{k(x), k(y), k(z)}, (Eigen::Vector3d(x, y, z).array() + 0.5) * resolution};
        const OccupancyMap::Lookup found = map.at(v.key);
        v.state = found.state == OccupancyMap::State::occupied ? State::occupied
                  : found.state == OccupancyMap::State::free   ? State::free
                                                               : State::unknown;
        v.log_odds = found.log_odds;
        if (found.point) {
          v.surface = found.point->surface;
          v.point = found.point->position.cast<double>();
          v.view = found.point->view.cast<double>();
        }
        all.push_back(v);
      }
  return all;
}

Eigen::Vector3d random_point(std::mt19937_64& rng, double half = 2) {
  std::uniform_real_distribution<double> uniform(-half, half);
  return {uniform(rng), uniform(rng), uniform(rng)};
}
Eigen::AlignedBox3d random_box(std::mt19937_64& rng) {
  Eigen::AlignedBox3d box(random_point(rng));
  box.extend(random_point(rng));
  return box;
}

/// By the threshold of occupied. 0.3 makes voxels occupied that rays only passed through: a miss leaves 0.4.
class View : public testing::TestWithParam<double> {
 protected:
  View() : map(parameters(GetParam())) {
    fill(map, rng, 6);
    view = map.share();
    voxels = list_of(map);
  }
  std::mt19937_64 rng = test::rng();
  OccupancyMap map;
  OccupancyView view;
  std::vector<Listed> voxels;
};
INSTANTIATE_TEST_SUITE_P(Thresholds, View, testing::Values(0.5, 0.3));

TEST_P(View, TellsEveryVoxel) {
  std::map<State, int> seen;
  int without_point = 0;
  for (const Listed& v : voxels) {
    const OccupancyView::Voxel found = view.at(v.centre);
    ASSERT_EQ(found.state, v.state);
    ASSERT_EQ(found.log_odds, v.log_odds);
    ASSERT_EQ(found.surface, v.surface);
    ASSERT_LT((found.center - v.centre).norm(), 1e-9);
    ASSERT_LT((found.point - v.point).norm(), 1e-6);
    ASSERT_LT((found.view - v.view).norm(), 1e-6);
    ++seen[v.state];
    without_point += v.state == State::occupied && v.log_odds < 0;
  }
  EXPECT_EQ(without_point > 100, GetParam() < 0.5);
  EXPECT_GT(seen[State::free], 100);
  EXPECT_GT(seen[State::occupied], 100);
  EXPECT_GT(seen[State::unknown], 100);
}

TEST_P(View, CountsAndVisitsBoxes) {
  for (int round = 0; round < 50; ++round) {
    const Eigen::AlignedBox3d box = random_box(rng);
    OccupancyView::Count expected;
    std::vector<Eigen::Vector3d> occupied;
    const std::size_t most = round % 2 == 0 ? 7 : voxels.size();
    for (const Listed& v : voxels) {
      if (!box.contains(v.centre)) continue;
      ++(v.state == State::occupied ? expected.occupied
         : v.state == State::free   ? expected.free
                                    : expected.unknown);
      if (v.state == State::occupied) occupied.push_back(v.centre);
    }
    const OccupancyView::Count count = view.count(box);
    EXPECT_EQ(count.occupied, expected.occupied);
    EXPECT_EQ(count.free, expected.free);
    EXPECT_EQ(count.unknown, expected.unknown);
    std::size_t visited = 0;
    view.for_each_occupied(box, [&](const OccupancyView::Voxel& v) {
      EXPECT_EQ(v.state, State::occupied);
      EXPECT_TRUE(std::any_of(occupied.begin(), occupied.end(),
                              [&](const auto& centre) { return (centre - v.center).norm() < 1e-9; }));
      return ++visited < most;
    });
    EXPECT_EQ(visited, std::min(most, occupied.size()));
  }
}

TEST_P(View, FindsTheNearestOccupiedVoxel) {
  int found_some = 0;
  for (int round = 0; round < 200; ++round) {
    const Eigen::Vector3d point = random_point(rng);
    const double limit = round % 2 == 0 ? 0.3 : 3;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Listed& v : voxels)
      if (v.state == State::occupied) nearest = std::min(nearest, (v.centre - point).norm());
    const auto found = view.nearest_occupied(point, limit);
    ASSERT_EQ(found.has_value(), nearest <= limit);
    if (!found) continue;
    EXPECT_NEAR((found->center - point).norm(), nearest, 1e-12);
    EXPECT_EQ(view.at(found->center).state, State::occupied);
    ++found_some;
  }
  EXPECT_GT(found_some, 50);
}

/// How much of the way from `a` to `b` is made when it enters a voxel; beyond 1 if it never does.
double entry(const Listed& v, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const auto [enter, leave] = test::part_in_cube(a, b, v.centre, resolution / 2);
  return leave - enter < 1e-9 ? 2 : enter;
}

TEST_P(View, StopsAWayAtTheFirstVoxelThatIsInIt) {
  int stopped = 0;
  for (int round = 0; round < 300; ++round) {
    const Eigen::Vector3d from = random_point(rng, 1.2);
    Eigen::Vector3d to = random_point(rng);
    if (round % 5 == 0) to = from + (to - from).x() * Eigen::Vector3d::Unit(round % 3);  // along an axis
    for (const bool unknown_stops : {false, true}) {
      double first = 2;
      for (const Listed& v : voxels)
        if (v.state == State::occupied || (unknown_stops && v.state == State::unknown))
          first = std::min(first, entry(v, from, to));
      const auto found = view.first_on_way(from, to, unknown_stops);
      ASSERT_EQ(found.has_value(), first <= 1) << from.transpose() << " to " << to.transpose();
      if (!found) continue;
      const Listed at{{}, found->center};
      EXPECT_NEAR(entry(at, from, to), first, 1e-9);
      EXPECT_NE(found->state, State::free);
      ++stopped;
    }
  }
  EXPECT_GT(stopped, 100);
}

TEST_P(View, KnowsNothingOutsideTheOctree) {
  const Eigen::Vector3d far(5000, 0, 0);
  EXPECT_EQ(view.at(far).state, State::unknown);
  EXPECT_FALSE(view.first_on_way(far, far + Eigen::Vector3d(10, 0, 0)).has_value());
  EXPECT_TRUE(view.first_on_way(far, far + Eigen::Vector3d(10, 0, 0), true).has_value());
  // Right through it, from outside to outside, along a line on which something is.
  const auto occupied =
      std::find_if(voxels.begin(), voxels.end(), [](const Listed& v) { return v.state == State::occupied; });
  ASSERT_NE(occupied, voxels.end());
  EXPECT_TRUE(view.first_on_way(occupied->centre + far, occupied->centre - far).has_value());
  EXPECT_FALSE(view.nearest_occupied(far, 100).has_value());
  const double inf = std::numeric_limits<double>::infinity();
  const Eigen::AlignedBox3d all(Eigen::Vector3d::Constant(-inf), Eigen::Vector3d::Constant(inf));
  EXPECT_EQ(view.count(all).unknown + view.count(all).free + view.count(all).occupied, std::size_t{1} << 48);
  const OccupancyView nothing;
  EXPECT_EQ(nothing.at({0, 0, 0}).state, State::unknown);
  EXPECT_FALSE(nothing.nearest_occupied({0, 0, 0}, 1).has_value());
  EXPECT_FALSE(nothing.first_on_way({0, 0, 0}, {1, 0, 0}).has_value());
  EXPECT_TRUE(nothing.first_on_way({0, 0, 0}, {1, 0, 0}, true).has_value());
}

TEST_P(View, RefusesWhatIsNoPlace) {
  const Eigen::Vector3d nan(std::nan(""), 0, 0);
  EXPECT_THROW(view.first_on_way(nan, {0, 0, 0}), Error);
  EXPECT_THROW(view.first_on_way({0, 0, 0}, nan), Error);
  EXPECT_THROW(view.nearest_occupied(nan, 1), Error);
  EXPECT_THROW(view.nearest_occupied({0, 0, 0}, -1), Error);
  EXPECT_THROW(view.count({nan, Eigen::Vector3d::Ones()}), Error);
  EXPECT_EQ(view.at(nan).state, State::unknown);
}

TEST(SharedView, StandsStillWhileTheMapGoesOnAndOutlivesIt) {
  std::mt19937_64 rng(test::seed());
  auto ours = std::make_unique<OccupancyMap>(parameters());
  OccupancyMap &map = *ours, alone(parameters());
  std::vector<OccupancyView> views;
  std::vector<std::vector<Listed>> expected;
  for (int scan = 0; scan < 8; ++scan) {
    const Scan next = test::room_scan(rng, 300, {1.6, 1.2, 0.9});
    insert(map, next);
    insert(alone, next);
    const std::vector<VoxelPoint> points = test::points_of(map);
    views.push_back(map.share());
    expected.push_back(list_of(map));
    for (const VoxelPoint& p : points) {  // after it is shared
      const auto surface = static_cast<SurfaceId>(rng() % 5);
      map.assign(p.key, surface);
      alone.assign(p.key, surface);
    }
  }
  EXPECT_EQ(test::bytes_of(map), test::bytes_of(alone)) << "whoever shares has the same map";
  ours.reset();
  for (std::size_t i = 0; i < views.size(); ++i)
    for (const Listed& v : expected[i]) {
      const OccupancyView::Voxel found = views[i].at(v.centre);
      ASSERT_EQ(found.state, v.state) << "view " << i;
      ASSERT_EQ(found.log_odds, v.log_odds);
      ASSERT_EQ(found.surface, v.surface);
    }
}

using Leaf = OccupancyView::Leaf;
using test::Voxels;

/// What for_each_change() makes of all that is known in `before`; every cube it tells must be different
/// there.
Voxels followed(const OccupancyView& before, const OccupancyView& now) {
  Voxels voxels = test::voxels_of(before);
  now.for_each_change(before, [&](const auto& corner, int level, std::span<const Leaf> leaves) {
    Voxels cube, was;
    for (const Leaf& leaf : leaves) test::add(leaf, cube);
    const auto inside = [&](const auto& voxel) {
      const auto [x, y, z] = voxel.first;
      return std::array{x >> level, y >> level, z >> level} ==
             std::array{corner[0] >> level, corner[1] >> level, corner[2] >> level};
    };
    std::copy_if(voxels.begin(), voxels.end(), std::inserter(was, was.end()), inside);
    EXPECT_NE(was, cube);
    std::erase_if(voxels, inside);
    voxels.merge(cube);
    EXPECT_TRUE(cube.empty()) << "leaves beyond their cube";
  });
  return voxels;
}

/// Views of a map as it grows, of another, and an empty one. Scans see the same walls again and again: free
/// space closes into large leaves, which the next room divides. Points change surfaces without a scan, too.
std::vector<OccupancyView> different_views() {
  std::mt19937_64 rng(test::seed());
  OccupancyMap map(parameters()), other(parameters());
  std::vector<OccupancyView> views{map.share()};
  for (int scan = 0; scan < 24; ++scan) {
    const double half = scan % 8 == 7 ? 0.3 : 0.8;
    insert(map, test::room_scan(rng, 1200, {half, half, half}));
    if (scan % 6 != 5) continue;
    views.push_back(map.share());
    for (const VoxelPoint& p : test::points_of(map))
      if (rng() % 50 == 0) map.assign(p.key, static_cast<SurfaceId>(rng() % 5));
    if (scan % 12 == 5) views.push_back(map.share());
  }
  insert(other, test::room_scan(rng, 300, {0.6, 0.7, 0.5}));
  views.push_back(other.share());
  views.emplace_back();
  return views;
}

TEST(SharedView, TellsWhatHasChangedSinceAnyOther) {
  const std::vector<OccupancyView> views = different_views();
  for (const OccupancyView& before : views)
    for (const OccupancyView& now : views) EXPECT_EQ(followed(before, now), test::voxels_of(now));
}

}  // namespace
}  // namespace octosurf::occupancy
