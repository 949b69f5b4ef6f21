// Why there is no surface at a place: a map for every reason.
#include "occupancy/octree_bytes.hpp"
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/map_state.hpp"

#include <octosurf/explain.hpp>

namespace octosurf::diagnosis {
namespace {

using test::rectangle_scan;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Eigen::Vector3d eye(0.5, 0.5, 1.5);

/// What explain() says, checked for what holds of every explanation.
Explanation ask(const Map& map, const Eigen::Vector3d& place) {
  const std::string before = test::digest(map);
  Explanation why = explain(map, place);
  EXPECT_TRUE(test::digest(map) == before) << "the map has changed";
  EXPECT_EQ(why.asked, place);
  EXPECT_FALSE(why.sentence.empty());
  EXPECT_EQ(why.sentence.find('\n'), std::string::npos);
  EXPECT_EQ(why.nearest != 0, map.size().surfaces > 0);
  if (why.looked_at) {
    const OccupancyView::Voxel voxel = map.at(*why.looked_at);
    EXPECT_EQ(voxel.state, OccupancyView::State::occupied);
    EXPECT_LE((*why.looked_at - place).norm(), map.parameters().max_hole_size());
  }
  for (const Figure& figure : why.figures) {  // whatever was refused missed its bound
    EXPECT_LE(figure.value, figure.at_least.value_or(figure.value)) << figure.name;
  }
  EXPECT_TRUE(why.around.empty() || why.around.contains(why.reason));
  return why;
}

Scan floor_scan() { return rectangle_scan(eye, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}); }

TEST(Explain, NamesAreDistinct) {
  std::set<std::string_view> names;
  for (int r = 0; r <= static_cast<int>(Reason::waiting); ++r)
    names.insert(reason_name(static_cast<Reason>(r)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(Reason::waiting) + 1);
  EXPECT_EQ(reason_name(Reason::on_surface), "on_surface");
  EXPECT_EQ(reason_name(Reason::too_narrow), "too_narrow");
  EXPECT_EQ(reason_name(Reason::waiting), "waiting");
}

TEST(Explain, OnASurface) {
  const Mapper mapper = test::mapped({floor_scan()});
  for (const double height : {0.01, 0.05}) {  // on it, and a few centimetres off
    const Explanation why = ask(mapper.map(), {0.5, 0.4, height});
    EXPECT_EQ(why.reason, Reason::on_surface);
    EXPECT_EQ(why.surface, 1U);
    EXPECT_THAT(why.sentence, HasSubstr("surface 1"));
    EXPECT_EQ(why.nearest, 1U);
    EXPECT_NEAR(why.nearest_distance, height - 0.01, 0.015)
        << "an inlier is at most half a voxel's diagonal away";
  }
}

TEST(Explain, InAHoleAndBesideASurface) {
  // A floor of four strips about a hole of 0.4 m.
  const Mapper mapper = test::mapped({rectangle_scan(eye, {0, 0, 0.01}, {1, 0, 0}, {0, 0.3, 0}),
                                      rectangle_scan(eye, {0, 0.7, 0.01}, {1, 0, 0}, {0, 0.3, 0}),
                                      rectangle_scan(eye, {0, 0.3, 0.01}, {0.3, 0, 0}, {0, 0.4, 0}),
                                      rectangle_scan(eye, {0.7, 0.3, 0.01}, {0.3, 0, 0}, {0, 0.4, 0})});
  ASSERT_EQ(mapper.map().size().surfaces, 1U);
  const SurfaceId floor = mapper.snapshot()->surfaces[0]->id;
  const Explanation middle = ask(mapper.map(), {0.5, 0.5, 0.01});
  EXPECT_EQ(middle.reason, Reason::in_hole);
  EXPECT_EQ(middle.surface, floor);
  EXPECT_FALSE(middle.looked_at) << "no point within h";
  EXPECT_NEAR(middle.nearest_distance, 0.2, 0.015);
  EXPECT_EQ(ask(mapper.map(), {0.34, 0.5, 0.01}).reason, Reason::in_hole);
  const Explanation outside = ask(mapper.map(), {-0.05, 0.5, 0.01});
  EXPECT_EQ(outside.reason, Reason::beside_surface);
  EXPECT_EQ(outside.surface, floor);
}

TEST(Explain, OutsideUnseenAndFree) {
  const Mapper mapper = test::mapped({floor_scan()});
  EXPECT_EQ(ask(mapper.map(), {0.5, 0.5, 0.5}).reason, Reason::free_space);
  EXPECT_EQ(ask(mapper.map(), {0.5, 0.5, -0.5}).reason, Reason::unseen);
  EXPECT_EQ(ask(mapper.map(), {5, 5, 1}).reason, Reason::unseen);
  const Explanation outside = explain(mapper.map(), {0, 0, 1e5});
  EXPECT_EQ(outside.reason, Reason::outside_map);
  EXPECT_FALSE(outside.looked_at);
  EXPECT_THROW(explain(mapper.map(), {0, std::nan(""), 0}), Error);
}

TEST(Explain, OccupiedWithoutAPoint) {
  const Mapper mapper = test::mapped({floor_scan()});
  auto state = std::make_unique<surfaces::MapState>(Parameters{});
  state->occupancy = test::octree_of_file(test::bt_of(surfaces::state_of(mapper.map()).occupancy));
  EXPECT_EQ(ask(surfaces::map_of(std::move(state)), {0.5, 0.5, 0.01}).reason, Reason::no_point);
}

TEST(Explain, IsolatedOrTooFewForAPlane) {
  const auto points = [](int count) {  // 3 cm apart, in a line
    Scan scan;
    scan.T_map_sensor.translation() = eye;
    for (int i = 0; i < count; ++i)
      scan.points.push_back((Eigen::Vector3d(0.01 + 0.03 * i, 0.01, 0.01) - eye).cast<float>());
    return scan;
  };
  const Mapper two = test::mapped({points(2)});  // one neighbour
  EXPECT_EQ(ask(two.map(), {0.01, 0.01, 0.02}).reason, Reason::isolated);
  const Mapper line = test::mapped({points(4)});
  const Explanation why = ask(line.map(), {0.04, 0.01, 0.02});
  EXPECT_EQ(why.reason, Reason::no_plane);
  EXPECT_EQ(why.around.at(Reason::no_plane), 4U) << "all are within 8 cm";
}

TEST(Explain, TooFewPoints) {
  const Mapper mapper = test::mapped({rectangle_scan(eye, {0, 0, 0.01}, {0.1, 0, 0}, {0, 0.1, 0})});
  const std::size_t points = mapper.map().size().points;
  ASSERT_LT(points, 50U);
  const Explanation why = ask(mapper.map(), {0.05, 0.05, 0.01});
  ASSERT_EQ(why.reason, Reason::too_few_points);
  ASSERT_EQ(why.figures.size(), 1U);
  EXPECT_EQ(why.figures[0].value, static_cast<double>(points));
  EXPECT_EQ(why.figures[0].at_least, 50);
  EXPECT_THAT(why.sentence, HasSubstr("only " + std::to_string(points) + " points"));
  EXPECT_EQ(why.around.at(Reason::too_few_points), points) << "all of them are within 8 cm";
}

TEST(Explain, TooNarrow) {
  const double width = 0.025;
  const Mapper mapper = test::mapped({rectangle_scan(eye, {0, 0.005, 0.01}, {1.5, 0, 0}, {0, width, 0})});
  const Explanation why = ask(mapper.map(), {0.75, 0.02, 0.01});
  ASSERT_EQ(why.reason, Reason::too_narrow) << why.sentence;
  ASSERT_EQ(why.figures.size(), 1U);
  EXPECT_NEAR(why.figures[0].value, width, 0.015) << "a voxel's point is inside it";
  EXPECT_EQ(why.figures[0].at_least, Parameters{}.surfaces.min_surface_width);
}

// 1 m of a floor from 2 m away and 2 cm above it: at half a degree, where views are kept to 4.
TEST(Explain, EdgeOn) {
  const Mapper mapper = test::mapped({rectangle_scan({-2, 0.5, 0.03}, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0})});
  const Explanation why = ask(mapper.map(), {0.5, 0.5, 0.01});
  ASSERT_EQ(why.reason, Reason::edge_on) << why.sentence;
  ASSERT_EQ(why.figures.size(), 1U);
  EXPECT_NEAR(why.figures[0].value, 0.02 / 2.5, 0.07);
  EXPECT_LE(why.figures[0].value, *why.figures[0].at_least);
  const Mapper from_higher =
      test::mapped({rectangle_scan({-2, 0.5, 0.41}, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0})});
  EXPECT_EQ(ask(from_higher.map(), {0.5, 0.5, 0.01}).reason, Reason::on_surface) << "at 9 degrees";
}

/// Of radius 0.25 m around the z axis, seen from +x.
Scan pillar_scan() {
  Scan pillar;
  pillar.T_map_sensor.translation() = Eigen::Vector3d(1.5, 0, 0.5);
  for (double z = 0; z < 1; z += 0.009)
    for (double a = -1.2; a < 1.2; a += 0.03)
      pillar.points.push_back(
          (Eigen::Vector3d(0.25 * std::cos(a), 0.25 * std::sin(a), z) - pillar.T_map_sensor.translation())
              .cast<float>());
  return pillar;
}

TEST(Explain, Curved) {
  Parameters parameters;
  parameters.detection.detect_cylinders = false;
  const Mapper mapper = test::mapped({pillar_scan()}, parameters);
  ASSERT_EQ(mapper.map().size().surfaces, 0U);
  EXPECT_EQ(ask(mapper.map(), {0.25, 0, 0.5}).reason, Reason::curved);
}

TEST(Explain, OnACylinder) {
  const Mapper mapper = test::mapped({floor_scan(), pillar_scan()});
  ASSERT_EQ(mapper.snapshot()->cylinders.size(), 1U);
  const CylinderId id = mapper.snapshot()->cylinders[0]->id;
  const Explanation why = ask(mapper.map(), {0.25, 0, 0.5});
  EXPECT_EQ(why.reason, Reason::on_cylinder);
  EXPECT_EQ(why.cylinder, id);
  EXPECT_EQ(why.surface, 0U);
  EXPECT_EQ(why.sentence, "No surface: this is on cylinder " + std::to_string(id) + ".");
  EXPECT_GT(why.around.at(Reason::on_cylinder), 10U) << "of the pending points within 8 cm";
  EXPECT_EQ(ask(mapper.map(), {0.5, 0.5, 0.01}).cylinder, 0U);
}

TEST(Explain, SeenThroughASurface) {
  // A wall that was seen thrice, the third time through a net 4 cm before it, which was hit as often.
  const Eigen::Vector3d from(1.5, 0.5, 0.5);
  const Scan wall = rectangle_scan(from, {0, 0, 0}, {0, 1, 0}, {0, 0, 1});
  Scan both = rectangle_scan(from, {0.041, 0.2, 0.2}, {0, 0.6, 0}, {0, 0, 0.6});
  both.points.insert(both.points.end(), wall.points.begin(), wall.points.end());
  const Mapper mapper = test::mapped({wall, wall, both});
  ASSERT_EQ(mapper.map().size().surfaces, 1U);
  const Explanation why = ask(mapper.map(), {0.041, 0.5, 0.5});
  ASSERT_EQ(why.reason, Reason::seen_through) << why.sentence;
  EXPECT_EQ(why.surface, mapper.snapshot()->surfaces[0]->id);
}

TEST(Explain, WaitingForANewPoint) {
  // A plate that is too small; then enough points come, but too few to look at it again.
  Mapper mapper = test::mapped({test::plate_scan(eye, 0, 8, 6)});
  EXPECT_EQ(ask(mapper.map(), {0.05, 0.05, 0.01}).reason, Reason::too_few_points);
  mapper.insert(test::plate_scan(eye, 8, 9, 4));
  ASSERT_EQ(mapper.map().size().surfaces, 0U);
  const Explanation why = ask(mapper.map(), {0.05, 0.05, 0.01});
  ASSERT_EQ(why.reason, Reason::waiting) << why.sentence;
  // It was true: once more have come there is a surface.
  mapper.insert(test::plate_scan(eye, 9, 18, 6));
  EXPECT_EQ(ask(mapper.map(), {0.05, 0.05, 0.01}).reason, Reason::on_surface);
}

/// A noisy floor, and beside it, where no ray to the floor passes, a plate that is too small, a cloud of
/// clutter and points far from everything.
Mapper cluttered_room(std::mt19937_64& rng) {
  std::normal_distribution<float> gauss(0, 0.01F);
  std::uniform_real_distribution<double> uniform(-0.15, 0.15);
  Mapper mapper;
  for (int i = 0; i < 3; ++i) {
    Scan scan = floor_scan();
    for (Eigen::Vector3f& p : scan.points) p *= 1 + gauss(rng) / p.norm();
    mapper.insert(scan);
  }
  Scan beside = rectangle_scan(eye, {1.3, 0, 0.41}, {0.1, 0, 0}, {0, 0.1, 0});
  for (int i = 0; i < 500; ++i)
    beside.points.push_back(
        (Eigen::Vector3d(1.6 + uniform(rng), 0.8 + uniform(rng), 0.5 + uniform(rng)) - eye).cast<float>());
  for (int i = 0; i < 5; ++i)
    beside.points.push_back((Eigen::Vector3d(1.3 + 0.2 * i, -0.4, 0.7) - eye).cast<float>());
  mapper.insert(beside);
  return mapper;
}

std::size_t within(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& place, double radius) {
  return static_cast<std::size_t>(std::count_if(points.begin(), points.end(),
                                                [&](const auto& p) { return (p - place).norm() <= radius; }));
}

TEST(Explain, EveryPendingPointOfARoomHasItsReason) {
  std::mt19937_64 rng = test::rng();
  const Mapper mapper = cluttered_room(rng);
  const Map& map = mapper.map();
  const double h = map.parameters().max_hole_size(), r = map.parameters().search_radius();
  std::vector<Eigen::Vector3d> pending;
  map.for_each_point([&](const OccupancyView::Voxel& voxel) {
    if (voxel.surface == 0) pending.push_back(voxel.point);
  });
  ASSERT_GT(pending.size(), 300U);
  std::map<Reason, int> seen;
  for (const Eigen::Vector3d& p : pending) {
    const bool alone = within(pending, p, r) < 3;  // itself and fewer than two more
    if (!alone && rng() % pending.size() >= 60) continue;
    const Explanation why = ask(map, p);
    SCOPED_TRACE(why.sentence);
    ++seen[why.reason];
    const Surface* about = mapper.snapshot()->find(why.surface);
    EXPECT_EQ(about != nullptr, why.surface != 0) << "a surface that there is";
    if (why.reason == Reason::on_surface || why.reason == Reason::in_hole) {
      ASSERT_TRUE(about);
      continue;
    }
    const std::set reasons{Reason::isolated,       Reason::no_plane,     Reason::clutter,
                           Reason::too_few_points, Reason::too_narrow,   Reason::edge_on,
                           Reason::curved,         Reason::seen_through, Reason::waiting};
    EXPECT_TRUE(reasons.contains(why.reason)) << "is no reason for a pending point";
    if (why.reason == Reason::clutter) {
      EXPECT_EQ(why.figures.at(0).name, "explained");
      EXPECT_EQ(why.figures[0].at_least, 0);
    }
    if (why.reason == Reason::too_few_points) {
      EXPECT_LT(why.figures.at(0).value, 50);
    }
    if (why.reason == Reason::seen_through) {
      ASSERT_TRUE(about);
      EXPECT_LT(std::fabs(about->plane.signed_distance(p)), 0.3);
    }
    if (why.reason == Reason::waiting) {
      EXPECT_FALSE(surfaces::state_of(map).queue.fresh.empty());
    }
    EXPECT_EQ(why.looked_at->cast<float>(), p.cast<float>());
    if (why.reason != Reason::waiting) {
      EXPECT_EQ(why.reason == Reason::isolated, alone);
    }
    std::size_t around = 0;
    for (const auto& [reason, points] : why.around) around += points;
    EXPECT_EQ(around, within(pending, p, h));
  }
  EXPECT_EQ(ask(map, {1.35, 0.05, 0.41}).reason, Reason::too_few_points);
  EXPECT_GE(seen[Reason::isolated], 5);
  EXPECT_GT(seen[Reason::no_plane] + seen[Reason::curved] + seen[Reason::clutter], 5);
}

}  // namespace
}  // namespace octosurf::diagnosis
