// Storeys and the ways between them, beside the truth of hand-made scenes.
#include "support/scene.hpp"

#include <octosurf/mapper.hpp>
#include <octosurf/storeys.hpp>

namespace octosurf {
namespace {

using test::Scene;

const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
constexpr double d = 0.03;

/// What cameras look at from places over `area`, `height` above them, to all sides and obliquely down.
struct Survey {
  Eigen::AlignedBox2d area;
  double height = 1.5;
  double floor = 0;
};

GroundView ground_of(const Scene& scene, const std::vector<Survey>& surveys) {
  std::mt19937_64 rng = test::rng();
  Mapper mapper(test::of_voxels(d, false));
  for (const Survey& survey : surveys) {
    const Eigen::Array2d size = survey.area.sizes(), count = (size / 2.2).ceil();
    for (double i = 0; i < count.x(); ++i)
      for (double k = 0; k < count.y(); ++k) {
        const Eigen::Vector2d at = survey.area.min().array() + size * (Eigen::Array2d(i, k) + 0.5) / count;
        const Eigen::Vector3d eye(at.x(), at.y(), survey.floor + survey.height);
        for (int turn = 0; turn < 4; ++turn) {
          const double yaw = (turn + 0.1) * std::numbers::pi / 2;
          const Eigen::Vector3d target =
              eye + 0.9 * (std::cos(yaw) * x + std::sin(yaw) * y) - survey.height * z;
          mapper.insert(test::camera_scan(scene, test::look_at(eye, target), rng, {180, 180, 98}));
        }
      }
  }
  mapper.drain();
  return {mapper.snapshot(), mapper.map().octree()};
}

StoreyLimits small_robot() {
  StoreyLimits limits;
  limits.radius_m = 0.2;
  limits.headroom_m = 1.2;
  return limits;
}

Eigen::AlignedBox2d box(double x0, double y0, double x1, double y1) {
  return {Eigen::Vector2d(x0, y0), Eigen::Vector2d(x1, y1)};
}

/// The share of the cells with their middle in a box that are of a kind.
double share(const Storey& storey, const Eigen::AlignedBox2d& part, StoreyCell kind) {
  double all = 0, some = 0;
  for (std::size_t cell = 0; cell < storey.cells.size(); ++cell)
    if (part.contains(storey.center_of(cell))) {
      ++all;
      some += storey.cells[cell] == kind ? 1 : 0;
    }
  return all > 0 ? some / all : 0;
}

void expect_heights(const Storey& storey, const std::function<double(const Eigen::Vector2d&)>& height) {
  for (std::size_t cell = 0; cell < storey.cells.size(); ++cell) {
    const Eigen::Vector2d at = storey.center_of(cell);
    if (storey.cells[cell] != StoreyCell::free) continue;
    EXPECT_NEAR(storey.elevation[cell], height(at), 0.015) << at.transpose();
  }
}

// A slot of any width from 8 cm, and a drop beyond x = 2.
TEST(Storeys, VoidsAndDropsAreOccupied) {
  std::mt19937_64 rng = test::rng();
  const double width = std::uniform_real_distribution(0.08, 0.4)(rng),
               at = std::uniform_real_distribution(0.0, 0.1)(rng);
  Scene scene;
  scene.rectangle({-2, -2, 0}, (2 + at) * x, 4 * y)
      .rectangle({at + width, -2, 0}, (2 - at - width) * x, 4 * y);
  scene.rectangle({at, -2, -0.6}, width * x, 4 * y).rectangle({2, -2, -0.4}, 2 * x, 4 * y);
  for (const double side : {at, at + width}) scene.rectangle({side, -2, -0.6}, 4 * y, 0.6 * z);
  scene.rectangle({2, -2, -0.4}, 4 * y, 0.4 * z);
  const std::vector<Storey> storeys = find_storeys(ground_of(scene, {{box(-2, -2, 4, 2)}}), small_robot());
  const auto of_floor = [&](const Eigen::Vector2d& place) {
    const auto left = std::find_if(storeys.begin(), storeys.end(), [&](const Storey& storey) {
      const auto cell = storey.cell_at(place);
      return cell && std::fabs(storey.elevation[*cell]) < 0.02;
    });
    return left == storeys.end() ? nullptr : &*left;
  };
  // The slot is longer than the floor, so what is beyond it is another storey.
  for (const double side : {-1.0, 1.2}) {
    SCOPED_TRACE(side);
    const Storey* storey = of_floor({side, 0});
    ASSERT_NE(storey, nullptr);
    expect_heights(*storey, [](const Eigen::Vector2d&) { return 0; });
    const double edge = 0.05;  // what ends in a cell ends there
    EXPECT_EQ(share(*storey, box(at + edge / 2, -1.8, at + width - edge / 2, 1.8), StoreyCell::free), 0);
    EXPECT_GT(share(*storey, box(at, -1.5, at + width, 1.5), StoreyCell::occupied), 0.7) << "as far as seen";
    if (side < 0) {
      EXPECT_GT(share(*storey, box(-1.7, -1.7, at - 2 * edge, 1.7), StoreyCell::free), 0.98);
      continue;
    }
    EXPECT_GT(share(*storey, box(at + width + 2 * edge, -1.7, 2 - 2 * edge, 1.7), StoreyCell::free), 0.98);
    EXPECT_EQ(share(*storey, box(2 + edge / 2, -2, 4, 2), StoreyCell::free), 0);
    EXPECT_GT(share(*storey, box(2, -1.5, 2.2, 1.5), StoreyCell::occupied), 0.95);
  }
}

TEST(Storeys, ATableIsAnObstacleAndAStageIsAStorey) {
  constexpr double table = 0.74, stage = 0.5;
  Scene scene;
  scene.rectangle({-3, -3, 0}, 6 * x, 6 * y);
  scene.box({-1.5, -1, table - 0.03}, {0.1, -0.2, table}).box({1, 0.5, 0}, {2.8, 2.8, stage});
  scene.box({-2.5, 1.5, 0}, {-1, 2.7, stage + 0.1});
  const GroundView view = ground_of(scene, {{box(-3, -3, 3, 3), 1.9}, {box(-3, -3, 3, 3), 0.6}});
  const Eigen::AlignedBox2d under_table = box(-1.45, -0.95, 0.05, -0.25);
  StoreyLimits limits = small_robot();
  std::vector<Storey> storeys = find_storeys(view, limits);
  ASSERT_EQ(storeys.size(), 2U);
  EXPECT_GT(share(storeys[0], under_table, StoreyCell::occupied), 0.95);
  EXPECT_GT(share(storeys[0], box(1.05, 0.55, 2.75, 2.75), StoreyCell::occupied), 0.95);
  EXPECT_GT(share(storeys[0], box(-2.7, -2.7, 2.7, -1.2), StoreyCell::free), 0.98);
  EXPECT_NEAR(storeys[1].height_m, stage, 0.01);  // 4.1 m²; the box beside it has 1.8 m²
  expect_heights(storeys[1], [](const Eigen::Vector2d&) { return stage; });
  // A dog fits under the table.
  limits.headroom_m = 0.6;
  storeys = find_storeys(view, limits);
  EXPECT_GT(share(storeys[0], under_table, StoreyCell::free), 0.95);
  // Who wants tables gets them, but nothing narrower than the robot.
  limits.min_area_m2 = 0.5;
  EXPECT_EQ(find_storeys(view, limits).size(), 4U);
  limits.radius_m = 0.47;
  EXPECT_EQ(find_storeys(view, limits).size(), 3U);
}

TEST(Storeys, OneAboveAnotherIsAnother) {
  constexpr double above = 2.3;
  Scene scene;
  scene.rectangle({-2, 0, 0}, 6 * x, 3 * y).box({1, 0, above - 0.2}, {4, 3, above});
  const GroundView view = ground_of(scene, {{box(-2, 0, 4, 3)}, {box(1, 0, 4, 3), 1.5, above}});
  const std::vector<Storey> storeys = find_storeys(view, small_robot());
  ASSERT_EQ(storeys.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    expect_heights(storeys[i], [&](const Eigen::Vector2d&) { return i == 0 ? 0 : above; });
    EXPECT_TRUE(storeys[i].seams.empty());
    EXPECT_GT(share(storeys[i], box(i == 0 ? 0.2 : 1.2, 0.2, 3.8, 2.8), StoreyCell::free), 0.98);
  }
  EXPECT_GT(share(storeys[1], box(0.8, 0.5, 0.95, 2.5), StoreyCell::occupied), 0.95) << "a drop";
  // A robot as tall as the room finds nothing below but what has no ceiling.
  StoreyLimits tall = small_robot();
  tall.headroom_m = above + 0.1;
  EXPECT_EQ(share(find_storeys(view, tall)[0], box(1.1, 0, 4, 3), StoreyCell::free), 0);
  EXPECT_TRUE(find_route(view, storeys, small_robot()).edges.empty());
}

TEST(Storeys, RampsJoinAndStepsUpToTheLimit) {
  constexpr double rise = 0.4, length = 2.5, kerb = 0.06;
  Scene scene;
  scene.rectangle({0, 0, 0}, 2 * x, 2.5 * y).rectangle({2, 0, 0}, length * x + rise * z, 2.5 * y);
  scene.rectangle({2 + length, 0, rise}, 2 * x, 2.5 * y);
  scene.box({4 + length, 0, 0}, {6 + length, 2.5, rise + kerb});
  const GroundView view = ground_of(scene, {{box(0, 0, 6 + length, 2.5), 1.7}});
  const auto height = [](const Eigen::Vector2d& at) {
    return at.x() > 4 + length ? rise + kerb : std::clamp((at.x() - 2) / length, 0.0, 1.0) * rise;
  };
  StoreyLimits limits = small_robot();
  for (const double step : {0.08, 0.04}) {
    limits.max_step_m = step;
    const std::vector<Storey> storeys = find_storeys(view, limits);
    ASSERT_EQ(storeys.size(), step > kerb ? 1U : 2U);
    const double end = step > kerb ? 5.8 + length : 3.8 + length;
    EXPECT_GT(share(storeys[0], box(0.2, 0.2, end, 2.3), StoreyCell::free), 0.98);
    if (step < kerb) expect_heights(storeys[1], [](const Eigen::Vector2d&) { return rise + kerb; });
    for (std::size_t cell = 0; cell < storeys[0].cells.size(); ++cell) {
      const Eigen::Vector2d at = storeys[0].center_of(cell);
      if (storeys[0].cells[cell] != StoreyCell::free || std::fabs(at.x() - 4 - length) < 0.05) continue;
      EXPECT_NEAR(storeys[0].elevation[cell], height(at), 0.02) << at.transpose();
    }
  }
}

// A floor, a ramp beside it and a gallery over it: one piece of ground that passes over itself.
TEST(Storeys, GroundOverItselfIsSplitAtASeam) {
  constexpr double above = 2;
  Scene scene;
  scene.rectangle({0, 0, 0}, 8 * x, 3 * y).rectangle({8, 0, 0}, 1.5 * x, 5 * y);
  scene.rectangle({8, 3, 0}, -7 * x + above * z, 2 * y).rectangle({-1, 0, above}, 2 * x, 5 * y);
  scene.rectangle({1, 0, above}, 3 * x, 3 * y);
  const GroundView view = ground_of(scene, {{box(0, 0, 9.5, 3)},
                                            {box(4, 3, 9.5, 5), 1.5, 0.5},
                                            {box(1, 3, 5, 5), 1.5, 1.5},
                                            {box(-1, 0, 4, 3), 1.5, above}});
  StoreyLimits limits = small_robot();
  limits.min_area_m2 = 2;
  const std::vector<Storey> storeys = find_storeys(view, limits);
  ASSERT_EQ(storeys.size(), 2U);
  EXPECT_GT(share(storeys[0], box(0.3, 0.3, 7.7, 2.7), StoreyCell::free), 0.98);
  EXPECT_GT(share(storeys[1], box(1.3, 0.3, 3.7, 2.5), StoreyCell::free), 0.95);
  for (const Storey& storey : storeys) EXPECT_EQ(storey.seams.size(), 1U);
  const StoreyRoute route = find_route(view, storeys, limits);
  ASSERT_EQ(route.edges.size(), 2U);
  for (const RouteEdge& edge : route.edges) {
    const RouteNode &from = route.nodes[edge.from], &to = route.nodes[edge.to];
    EXPECT_EQ(from.storey + to.storey, 1U);
    EXPECT_FALSE(edge.stair);
    EXPECT_LT((from.at - to.at).norm(), 2 * (limits.radius_m + limits.cell_m));
  }
}

// Two stairs to two stages, a wall between their feet.
TEST(Storeys, RoutesGoOverStairsAndAroundWalls) {
  constexpr double riser = 0.16, tread = 0.28;
  Scene scene;
  scene.rectangle({-1, -1, 0}, 7 * x, 4 * y).box({2.4, -1, 0}, {2.6, 1.8, 1.5});
  for (const double at : {0.2, 3.8}) {
    for (int k = 0; k < 3; ++k)
      scene.box({at, -0.2 - (k + 1) * tread, 0}, {at + 1, -0.2 - k * tread, (k + 1) * riser});
    scene.box({at, -2.5, 0}, {at + 1, -0.2 - 3 * tread, 4 * riser});
  }
  const GroundView view = ground_of(scene, {{box(-1, -1, 6, 3), 1.6}, {box(-0.2, -2.6, 5.2, 0), 1.5, 0.6}});
  ASSERT_EQ(view.stairs().stairs.size(), 2U);
  const StoreyLimits limits = small_robot();
  const std::vector<Storey> storeys = find_storeys(view, limits);
  ASSERT_EQ(storeys.size(), 3U) << "stages are smaller than min_area_m2, but stairs lead up";
  const StoreyRoute route = find_route(view, storeys, limits);
  EXPECT_TRUE(route.without_landing.empty());
  std::size_t up = 0, landings = 0;
  double on_floor = 0;
  for (const RouteNode& node : route.nodes) landings += node.place == RoutePlace::landing ? 1 : 0;
  EXPECT_EQ(landings, 4U);
  for (const RouteEdge& edge : route.edges) {
    const RouteNode &from = route.nodes[edge.from], &to = route.nodes[edge.to];
    if (!edge.stair) {
      EXPECT_EQ(from.storey, 0U);
      EXPECT_EQ(to.storey, 0U);
      on_floor += edge.length_m / 2;
      for (double k = 0; k <= 1; k += 0.02) {
        const Eigen::Vector3d at = from.at + k * (to.at - from.at);
        EXPECT_EQ(storeys[0].cells[*storeys[0].cell_at(at.head<2>())], StoreyCell::free);
        EXPECT_GT((at.head<2>() - Eigen::Vector2d(2.5, 1.8)).norm(), limits.radius_m - 0.05);
      }
      continue;
    }
    up += edge.up ? 1 : 0;
    EXPECT_NEAR(to.at.z() - from.at.z(), edge.up ? 4 * riser : -4 * riser, 0.02);
    EXPECT_NEAR(
        std::remainder(edge.heading_rad - (edge.up ? -1 : 1) * std::numbers::pi / 2, 2 * std::numbers::pi), 0,
        0.05);
    EXPECT_EQ(edge.over_stair.size(), 4U);
  }
  EXPECT_EQ(up, 2U);
  // From foot to foot about the wall's end.
  const double reach = limits.radius_m + 0.03;
  const Eigen::Vector2d foot(0.7, -0.2 + reach), corner(2.4 - reach / 2, 1.8 + reach / 2);
  EXPECT_NEAR(on_floor, 2 * (corner - foot).norm() + 0.2 + reach, 0.25);
}

TEST(Storeys, LimitsOutOfRangeAreRefused) {
  Scene scene;
  scene.rectangle({-1, -1, 0}, 2 * x, 2 * y);
  const GroundView view = ground_of(scene, {{box(-1, -1, 1, 1)}});
  const auto refused = [&](const std::function<void(StoreyLimits&)>& change) {
    StoreyLimits limits;
    change(limits);
    EXPECT_THROW(find_storeys(view, limits), Error);
    EXPECT_THROW(find_route(view, {}, limits), Error);
  };
  refused([](StoreyLimits& limits) { limits.cell_m = 0; });
  refused([](StoreyLimits& limits) { limits.radius_m = -1; });
  refused([](StoreyLimits& limits) { limits.max_step_m = std::nan(""); });
  refused([](StoreyLimits& limits) { limits.headroom_m = 0.05; });
  refused([](StoreyLimits& limits) { limits.min_area_m2 = -1; });
  refused([](StoreyLimits& limits) { limits.turn.coeffs() *= 2; });
  EXPECT_EQ(find_storeys(view).size(), 1U) << "the largest ground, however small";
}

}  // namespace
}  // namespace octosurf
