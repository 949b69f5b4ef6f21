// The ground around a robot, beside the truth of hand-made scenes.
#include "support/scene.hpp"

#include <octosurf/ground_patch.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

using test::Scene;

const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);

/// The ground of a scene that cameras at `eyes` saw, each looking at the next of `targets`.
GroundView ground_of(const Scene& scene, const std::vector<Eigen::Vector3d>& eyes,
                     const std::vector<Eigen::Vector3d>& targets) {
  std::mt19937_64 rng = test::rng();
  Mapper mapper(test::of_voxels(0.02, false));
  for (std::size_t i = 0; i < eyes.size(); ++i)
    mapper.insert(
        test::camera_scan(scene, test::look_at(eyes[i], targets[i % targets.size()]), rng, {400, 300, 300}));
  mapper.drain();
  return {mapper.snapshot(), mapper.map().octree()};
}

std::vector<Eigen::Vector3d> circle(const Eigen::Vector3d& middle, double radius, int count) {
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < count; ++i) {
    const double turn = 2 * std::numbers::pi * (i + 0.3) / count;
    places.emplace_back(middle + radius * (std::cos(turn) * x + std::sin(turn) * y));
  }
  return places;
}

Eigen::Isometry3d base_at(const Eigen::Vector3d& place, double yaw) {
  Eigen::Isometry3d T_map_base(Eigen::AngleAxisd(yaw, z) * Eigen::AngleAxisd(0.1, x) *
                               Eigen::AngleAxisd(-0.15, y));
  T_map_base.translation() = place;
  return T_map_base;
}

/// Calls `check(map frame place at the height found, else at the base's, index)` for all points.
void for_each_place(const GroundPatch& patch, const PatchLayout& layout, const Eigen::Isometry3d& T_map_base,
                    const std::function<void(const Eigen::Vector3d&, std::size_t)>& check) {
  const Eigen::Vector3d forward = T_map_base.linear().col(0);
  const double yaw = std::atan2(forward.y(), forward.x());
  for (std::size_t i = 0; i < layout.points.size(); ++i) {
    const Eigen::Vector2d at = Eigen::Rotation2Dd(yaw) * layout.points[i];
    check(T_map_base.translation() +
              Eigen::Vector3d(at.x(), at.y(), std::isnan(patch.height[i]) ? 0 : patch.height[i]),
          i);
  }
}

// A floor with a step on it, a table over it and the next storey's floor above.
TEST(GroundPatch, IsOfTheStoreyThatTheRobotStandsOn) {
  constexpr double floor = 0.013, step = 0.16, table = 0.72, storey = 2.4;
  Scene scene;
  scene.rectangle({-2, -2, floor}, 4 * x, 4 * y).rectangle({-2, -2, storey}, 4 * x, 4 * y);
  scene.rectangle({-2, -2, storey - 0.2}, 4 * x, 4 * y);
  scene.box({0.31, -0.5, floor}, {0.71, 0.5, floor + step});
  scene.box({-0.9, 0.2, table - 0.03}, {-0.1, 0.9, table});
  std::vector<Eigen::Vector3d> eyes = circle({0, 0, 0.45}, 1.2, 12), above = circle({0, 0, storey + 1}, 1, 6);
  for (const Eigen::Vector3d& eye : circle({0, 0, 1.3}, 1.2, 12)) eyes.push_back(eye);
  eyes.insert(eyes.end(), above.begin(), above.end());
  std::vector<Eigen::Vector3d> targets(24, Eigen::Vector3d(0, 0, 0.1));
  targets.resize(30, Eigen::Vector3d(0, 0, storey));
  const GroundView view = ground_of(scene, eyes, targets);
  const PatchLayout low = [] {
    PatchLayout layout = PatchLayout::grid();
    layout.headroom_m = 0.5;
    return layout;
  }();
  PatchLayout high = low;
  high.headroom_m = 1.2;
  for (const double yaw : {0.0, 0.7, 2.5}) {
    SCOPED_TRACE(yaw);
    const Eigen::Isometry3d base = base_at({-0.05, 0.05, floor + 0.4}, yaw);
    std::size_t known = 0, right = 0, under = 0;
    const GroundPatch patch = ground_patch(view, base, low);
    for_each_place(patch, low, base, [&](const Eigen::Vector3d& p, std::size_t i) {
      if (std::isnan(patch.height[i])) return;
      const bool on_step = p.x() > 0.31 && p.x() < 0.71 && std::fabs(p.y()) < 0.5;
      ++known;
      right += std::fabs(p.z() - floor - (on_step ? step : 0)) < 0.01;
      under += p.x() > -0.9 && p.x() < -0.1 && p.y() > 0.2 && p.y() < 0.9;
    });
    EXPECT_GT(known, 0.98 * static_cast<double>(low.points.size()));
    EXPECT_GE(static_cast<double>(right), 0.99 * static_cast<double>(known));
    EXPECT_GT(under, 20U);
    // A taller robot is under no table.
    const GroundPatch tall = ground_patch(view, base, high);
    for_each_place(tall, high, base, [&](const Eigen::Vector3d& p, std::size_t i) {
      if (p.x() < -0.87 || p.x() > -0.13 || p.y() < 0.23 || p.y() > 0.87) return;
      EXPECT_EQ(tall.cell[i], PatchCell::occupied) << p.transpose();
      EXPECT_NEAR(p.z(), table, 0.01);
    });
  }
  // Upstairs, the floor is that of upstairs.
  const Eigen::Isometry3d upstairs = base_at({0, 0, storey + 0.4}, 1);
  const GroundPatch patch = ground_patch(view, upstairs, low);
  std::size_t there = 0;
  for_each_place(patch, low, upstairs, [&](const Eigen::Vector3d& p, std::size_t i) {
    if (patch.cell[i] != PatchCell::supported) return;
    EXPECT_NEAR(p.z(), storey, 0.01);
    ++there;
  });
  EXPECT_GT(there, 0.9 * static_cast<double>(low.points.size()));
}

/// Of a spinning lidar, its pose off by 5 mm.
Scan lidar_scan(const Scene& scene, const Eigen::Vector3d& eye, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss(0, 0.005);
  Scan scan = test::spinning_scan(scene, Eigen::Isometry3d(Eigen::Translation3d(eye)), rng,
                                  test::rings(-0.5, 0.035, 29), 898, 0.015);
  scan.sensor = SensorKind::depth_camera;  // as far as that sees
  scan.T_map_sensor.translation() += Eigen::Vector3d(gauss(rng), gauss(rng), gauss(rng));
  return scan;
}

// A hall's floor with a slot of 10 cm and a stairwell, from low and high sensors.
TEST(GroundPatch, VoidsAreNoGroundToALidarAndItsFloorIsWhole) {
  constexpr double slot = 1, well = -1.5, depth = 0.6;
  Scene hall;
  hall.rectangle({well, -4, 0.01}, (slot - well) * x, 8 * y).rectangle({slot + 0.1, -4, 0.01}, 3 * x, 8 * y);
  hall.rectangle({-4, -4, -2.5}, (4 + well) * x, 8 * y).rectangle({well, -4, 0.01}, -2.51 * z, 8 * y);
  hall.rectangle({slot, -4, -depth}, 0.1 * x, 8 * y).box({-4, -4, -2.5}, {4, 4, 3});
  for (const double at : {slot, slot + 0.1}) hall.rectangle({at, -4, 0.01}, -depth * z, 8 * y);
  for (const double d : {0.05, 0.1}) {
    std::size_t floor = 0, open = 0, voids = 0, stood_on = 0;
    for (const double height : {0.5, 1.0, 1.5, 2.0}) {
      std::mt19937_64 rng = test::rng();
      Mapper mapper(test::of_voxels(d, false));
      for (double at = -2; at < 2; at += 0.25) mapper.insert(lidar_scan(hall, {0.2, at, height}, rng));
      mapper.drain();
      const GroundView view(mapper.snapshot(), mapper.map().octree());
      const Eigen::Isometry3d base = base_at({0, 0, 0.5}, 0);
      const PatchLayout layout = PatchLayout::grid(4, 3, 0.05, {0.025, 0});
      const GroundPatch patch = ground_patch(view, base, layout);
      for (std::size_t i = 0; i < layout.points.size(); ++i) {
        const double at = layout.points[i].x(), into_slot = 0.05 - std::fabs(at - slot - 0.05),
                     into_void = std::max(into_slot, well - at);
        floor += into_void < -2 * d;
        open += into_void < -2 * d && patch.cell[i] == PatchCell::below;
        // Outlines extend beyond an edge by up to d, and noise reaches into a slot of two voxels.
        if (into_slot <= 0.9 * d && well - at <= 1.01 * d) continue;
        ++voids;
        stood_on += patch.cell[i] == PatchCell::supported;
      }
    }
    EXPECT_LE(static_cast<double>(open), 0.001 * static_cast<double>(floor)) << d;
    EXPECT_LE(static_cast<double>(stood_on), 0.002 * static_cast<double>(voids)) << d;
  }
}

// The ground rises, and what hangs over it is higher above the base than the headroom.
TEST(GroundPatch, IsClearUpToTheHeadroomOverAStep) {
  Scene scene;
  scene.rectangle({-1, -1, 0.011}, 1.2 * x, 2 * y).rectangle({0.2, -1, 0.29}, 1 * x, 2 * y);
  scene.rectangle({0.2, -1, 0.011}, 0.279 * z, 2 * y).rectangle({0.5, -1, 0.74}, 0.5 * x, 2 * y);
  std::vector<Eigen::Vector3d> eyes = circle({0, 0, 0.5}, 0.8, 8);
  for (const Eigen::Vector3d& eye : circle({0.2, 0, 1.6}, 0.8, 8)) eyes.push_back(eye);
  const GroundView view = ground_of(scene, eyes, {{0.2, 0, 0.2}, {0.5, 0, 0.4}});
  PatchLayout layout;
  layout.points = {{0.35, 0}, {0.6, 0}};
  layout.headroom_m = 0.5;
  const GroundPatch patch = ground_patch(view, base_at({0, 0, 0.16}, 0), layout);
  EXPECT_EQ(patch.cell, (std::vector{PatchCell::supported, PatchCell::occupied}));
}

TEST(GroundPatch, SaysHowFarTheEdgeIs) {
  Scene scene;
  scene.rectangle({-1.5, -1, 0.011}, 2 * x, 2 * y).rectangle({-1.5, -1, -0.6}, 4 * x, 2 * y);
  const GroundView view = ground_of(scene, circle({0, 0, 1.2}, 0.9, 12), {{0.3, 0, 0}, {-0.3, 0, 0}});
  const Eigen::Isometry3d base = base_at({0, 0, 0.5}, 0);
  PatchLayout row;
  for (double at = -0.4; at < 0.46; at += 0.03) row.points.emplace_back(at, 0.1);
  const GroundPatch patch = ground_patch(view, base, row);
  for (std::size_t i = 0; i < row.points.size(); ++i) {
    const double edge = std::min(0.5 - row.points[i].x(), Foothold::farthest_margin_m);
    EXPECT_EQ(patch.cell[i], PatchCell::supported) << row.points[i].x();
    EXPECT_NEAR(patch.edge_m[i], edge, 0.05) << row.points[i].x();
    EXPECT_NEAR(patch.slope_rad[i], 0, 0.02);
  }
}

TEST(GroundPatch, RefusesWhatItCannotRead) {
  Scene scene;
  scene.rectangle({-1, -1, 0.011}, 2 * x, 2 * y);
  const GroundView view = ground_of(scene, {{0, 0, 1}}, {{0.1, 0, 0}});
  const Eigen::Isometry3d base = base_at({0, 0, 0.5}, 0);
  PatchLayout layout;
  EXPECT_THROW(ground_patch(view, base, layout), Error);  // no points
  layout.points = {{6, 0}};
  EXPECT_THROW(ground_patch(view, base, layout), Error);
  layout = PatchLayout::grid();
  layout.max_step_m = 0;
  EXPECT_THROW(ground_patch(view, base, layout), Error);
  EXPECT_THROW(PatchLayout::grid(1, 1, 0), Error);
  Eigen::Isometry3d scaled = base;
  scaled.linear() *= 2;
  EXPECT_THROW(ground_patch(view, scaled), Error);
  // Far from everything nothing is known.
  for (const PatchCell cell : ground_patch(view, base_at({9, 9, 9}, 0)).cell)
    EXPECT_EQ(cell, PatchCell::unseen);
}

}  // namespace
}  // namespace octosurf
