#include "reference/paper_pipeline.hpp"

#include "support/seed.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <random>

#include <octosurf/error.hpp>

namespace octosurf::reference {
namespace {

/// A flat rectangle [0, width] × [0, height] along two unit axes from a corner.
struct Panel {
  Eigen::Vector3d corner, along, up;
  double width, height;
  std::function<bool(double, double)> present = [](double, double) { return true; };

  Eigen::Vector3d normal() const { return along.cross(up); }
};

const Panel floor_panel{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 2.0, 1.6};
const Panel wall_x{{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1.6, 1.2};  // faces +x
const Panel wall_y{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 1.2, 2.0};  // faces +y
constexpr double noise = 0.002;

/// Turned and shifted, so that no panel lies on a voxel border.
Eigen::Isometry3d world() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.2, -0.4, 0.9).normalized()));
  T.translation() = Eigen::Vector3d(0.317, -1.113, 0.071);
  return T;
}

/// The noisy scan of that number from `eye` that sees all of the panels, about 1.3 points per (cm)².
Scan scan_of(const std::vector<Panel>& panels, const Eigen::Vector3d& eye, std::uint64_t index) {
  std::mt19937_64 random(test::seed() + index);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> error(0, noise);
  Scan scan;
  scan.name = "scan " + std::to_string(index);
  scan.T_map_sensor = world() * Eigen::Translation3d(eye);
  scan.T_map_sensor.rotate(Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitY()));
  const Eigen::Isometry3d T_sensor_world = scan.T_map_sensor.inverse() * world();
  for (const Panel& panel : panels) {
    const int count = static_cast<int>(panel.width * panel.height * 13000);
    for (int i = 0; i < count; ++i) {
      const double u = unit(random) * panel.width, v = unit(random) * panel.height;
      if (!panel.present(u, v)) continue;
      const Eigen::Vector3d point =
          panel.corner + u * panel.along + v * panel.up + error(random) * panel.normal();
      scan.points.push_back((T_sensor_world * point).cast<float>());
    }
  }
  return scan;
}

const Surface* surface_along(const Snapshot& snapshot, const Panel& panel) {
  const Eigen::Vector3d normal = world().linear() * panel.normal();
  const Eigen::Vector3d center =
      world() * (panel.corner + panel.width / 2 * panel.along + panel.height / 2 * panel.up);
  const Surface* best = nullptr;
  for (const SurfacePtr& surface : snapshot.surfaces)
    if (surface->plane.normal.dot(normal) > std::cos(0.02) &&
        std::abs(surface->plane.signed_distance(center)) < 0.01 &&
        (best == nullptr || surface->area_m2 > best->area_m2))
      best = surface.get();
  return best;
}

std::size_t points_in(const PaperPipeline& pipeline) {
  std::size_t sum = pipeline.pending() + pipeline.outliers();
  for (const SurfacePtr& surface : pipeline.snapshot().surfaces) sum += surface->inliers;
  return sum;
}

Parameters quick_parameters() { return paper_parameters_small_radius(0.02); }

TEST(PaperPipeline, FindsFloorAndTwoWallsOverSeveralScans) {
  PaperPipeline pipeline(quick_parameters());
  std::size_t fresh = 0;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const PaperReport report =
        pipeline.insert(scan_of({floor_panel, wall_x, wall_y}, {1.2 + 0.2 * k, 1.1, 0.9}, k));
    fresh += report.points_new;
    EXPECT_LE(report.categorized, report.points_new);
    EXPECT_LE(report.points_new, report.voxels);
    EXPECT_EQ(points_in(pipeline), fresh) << "every point is an inlier once, pending or an outlier";
  }
  const Snapshot snapshot = pipeline.snapshot();
  EXPECT_EQ(snapshot.surfaces.size(), 3u);
  for (const Panel& panel : {floor_panel, wall_x, wall_y}) {
    const Surface* surface = surface_along(snapshot, panel);
    ASSERT_NE(surface, nullptr) << "facing " << panel.normal().transpose();
    // Centroids lie half a voxel inside the edges, and near the other panels' s-slab a strip of up
    // to s + d may be theirs: 6 cm on two sides of the smallest panel, 9 % of it.
    const double truth = panel.width * panel.height;
    EXPECT_LT(surface->area_m2, truth * 1.02);
    EXPECT_GT(surface->area_m2, truth * 0.90);
    EXPECT_LT(surface->rms_m, quick_parameters().surface_tolerance());
    EXPECT_EQ(surface->polygons.size(), 1u);
  }
}

TEST(PaperPipeline, GrowsASurfaceInsteadOfFindingItAgain) {
  Panel half = floor_panel;
  half.present = [](double u, double) { return u < 1.0; };
  PaperPipeline pipeline(quick_parameters());
  pipeline.insert(scan_of({half}, {1, 0.8, 1.5}, 1));
  ASSERT_EQ(pipeline.snapshot().surfaces.size(), 1u);
  const double first = pipeline.snapshot().surfaces[0]->area_m2;
  EXPECT_NEAR(first, 1.6, 0.08);
  pipeline.insert(scan_of({floor_panel}, {1, 0.8, 1.5}, 2));
  ASSERT_EQ(pipeline.snapshot().surfaces.size(), 1u);
  EXPECT_EQ(pipeline.snapshot().surfaces[0]->id, 1u);
  EXPECT_NEAR(pipeline.snapshot().surfaces[0]->area_m2, 3.2, 0.1);
}

TEST(PaperPipeline, TableKeepsItsHole) {
  Panel table{{0.4, 0.3, 0.7}, {1, 0, 0}, {0, 1, 0}, 1.2, 0.9};
  const auto in_hole = [](double u, double v) {
    return std::abs(u - 0.6) < 0.15 && std::abs(v - 0.45) < 0.15;
  };
  table.present = [&](double u, double v) { return !in_hole(u, v); };
  PaperPipeline pipeline(quick_parameters());
  pipeline.insert(scan_of({floor_panel, table}, {1, 0.7, 1.6}, 1));
  pipeline.insert(scan_of({floor_panel, table}, {1.1, 0.7, 1.6}, 2));
  EXPECT_EQ(pipeline.snapshot().surfaces.size(), 2u);
  const Snapshot before = pipeline.snapshot();
  const Surface* top = surface_along(before, table);
  ASSERT_NE(top, nullptr);
  ASSERT_EQ(top->polygons.size(), 1u);
  EXPECT_EQ(top->polygons[0].holes.size(), 1u);
  EXPECT_NEAR(top->area_m2, 1.2 * 0.9 - 0.09, 0.05);

  // A coaster in the middle of the hole, 11 cm from its rim: inside the outer ring, on the plane, yet
  // no inlier, because it is inside an even number of rings and farther than h from any boundary.
  Panel coaster = table;
  coaster.present = [](double u, double v) { return std::abs(u - 0.6) < 0.04 && std::abs(v - 0.45) < 0.04; };
  const std::size_t pending = pipeline.pending();
  const PaperReport report = pipeline.insert(scan_of({coaster}, {1, 0.7, 1.6}, 3));
  EXPECT_GT(report.points_new, 8u);
  EXPECT_EQ(report.categorized, 0u);
  EXPECT_EQ(pipeline.pending() + report.outliers, pending + report.points_new);
}

TEST(PaperPipeline, OldPointsChangeNothing) {
  PaperPipeline pipeline(quick_parameters());
  const Scan scan = scan_of({floor_panel}, {1, 0.8, 1.5}, 1);
  pipeline.insert(scan);
  const PaperReport again = pipeline.insert(scan);
  EXPECT_GT(again.voxels, 0u);
  EXPECT_EQ(again.points_new, 0u);
}

TEST(PaperPipeline, OfflineOnTheWholeCloudFindsTheSame) {
  const Scan scan = scan_of({floor_panel, wall_x}, {1.2, 1.1, 0.9}, 1);
  std::vector<Eigen::Vector3f> points, views;
  for (const Eigen::Vector3f& point : scan.points) {
    points.push_back((scan.T_map_sensor * point.cast<double>()).cast<float>());
    views.push_back(scan.T_map_sensor.translation().cast<float>() - points.back());
  }
  const Snapshot snapshot = paper_pipeline_offline(points, views, quick_parameters());
  EXPECT_EQ(snapshot.surfaces.size(), 2u);
  EXPECT_NE(surface_along(snapshot, floor_panel), nullptr);
  EXPECT_NE(surface_along(snapshot, wall_x), nullptr);
}

TEST(PaperPipeline, CollectedScansAreDetectedAtOnce) {
  PaperPipeline pipeline(quick_parameters());
  for (std::uint32_t k = 0; k < 2; ++k) {
    pipeline.collect(scan_of({floor_panel, wall_x}, {1.2, 1.1, 0.9}, k));
    EXPECT_TRUE(pipeline.snapshot().surfaces.empty());
  }
  const std::size_t collected = pipeline.pending();
  pipeline.detect_collected();
  EXPECT_EQ(points_in(pipeline), collected);
  EXPECT_EQ(pipeline.snapshot().surfaces.size(), 2u);
}

TEST(PaperPipeline, SameScansSameSurfaces) {
  std::vector<Snapshot> runs;
  for (int run = 0; run < 2; ++run) {
    PaperPipeline pipeline(quick_parameters());
    for (std::uint32_t k = 0; k < 2; ++k) pipeline.insert(scan_of({floor_panel, wall_x}, {1.2, 1.1, 0.9}, k));
    runs.push_back(pipeline.snapshot());
  }
  ASSERT_EQ(runs[0].surfaces.size(), runs[1].surfaces.size());
  for (std::size_t i = 0; i < runs[0].surfaces.size(); ++i) {
    EXPECT_EQ(runs[0].surfaces[i]->plane.normal, runs[1].surfaces[i]->plane.normal);
    EXPECT_EQ(runs[0].surfaces[i]->area_m2, runs[1].surfaces[i]->area_m2);
    EXPECT_EQ(runs[0].surfaces[i]->boundary, runs[1].surfaces[i]->boundary);
  }
}

TEST(PaperPipeline, RefusesWhatItCannotUse) {
  PaperPipeline pipeline(quick_parameters());
  Scan scaled = scan_of({floor_panel}, {1, 0.8, 1.5}, 1);
  scaled.T_map_sensor.linear() *= 2;
  EXPECT_THROW(pipeline.insert(scaled), Error);
  EXPECT_THROW(pipeline.insert_points({Eigen::Vector3f::Zero()}, {}), Error);
  Scan huge;
  huge.sensor = SensorKind::lidar;
  huge.points = {{-500, -500, -500}, {500, 500, 500}};
  EXPECT_THROW(pipeline.insert(huge), Error);
  Scan nothing;
  nothing.points = {Eigen::Vector3f::Constant(std::nanf(""))};
  EXPECT_EQ(pipeline.insert(nothing).voxels, 0u);
}

}  // namespace
}  // namespace octosurf::reference
