// Visible cells: inside their polygons, and each really in sight of some scan.
#include "simulation/faces.hpp"
#include "simulation/fixture.hpp"
#include "simulation/recording.hpp"
#include "simulation/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace octosurf::simulation {
namespace {

TEST(VisibleCells, LieInPolygonsInOrderAndSumUp) {
  for (const auto& [sensor, scene, scans] :
       {std::tuple("depth", "office", 6u), std::tuple("tilting", "stones", 60u),
        std::tuple("spinning", "change", 6u)}) {
    const evaluation::Truth truth = Recording(options_of(scene, sensor, scans)).truth();
    EXPECT_EQ(truth.scene, scene);
    EXPECT_EQ(truth.sensor, sensor);
    EXPECT_EQ(truth.cell, truth.sensor == "depth" ? 0.01 : 0.05);
    std::size_t seen = 0;
    for (const auto& face : truth.faces) {
      std::size_t cells = 0;
      auto last = std::pair(std::numeric_limits<int>::min(), 0);  // row, and the column behind it
      for (const auto& run : face.visible) {
        ASSERT_GT(run.count, 0);
        ASSERT_GT(std::pair(run.row, run.column), last);
        last = {run.row, run.column + run.count};
        cells += run.count;
        for (int c = run.column; c < run.column + run.count; ++c)
          ASSERT_TRUE(contains(face.polygons[0], truth.cell * Eigen::Vector2d(c + 0.5, run.row + 0.5)))
              << face.name;
      }
      EXPECT_NEAR(face.visible_area_m2, static_cast<double>(cells) * truth.cell * truth.cell, 1e-9);
      if (face.visible_area_m2 >= 0.05) ++seen;
    }
    EXPECT_GE(seen, 8u) << scene << " " << sensor;
  }
}

/// True if some scan of the camera has a reading of this face right at `point`'s pixel or beside it.
bool in_sight(const Recording& recording, const std::vector<Readings>& readings,
              const evaluation::TrueFace& face, const Eigen::Vector3d& point) {
  using namespace simulation;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const Eigen::Vector3d p = recording.true_pose(i).inverse() * point;
    if (p.z() < 0.4 || p.norm() > 4.05) continue;
    const int u = static_cast<int>(std::lround(depth_focal * p.x() / p.z() + depth_center_x));
    const int v = static_cast<int>(std::lround(depth_focal * p.y() / p.z() + depth_center_y));
    // A cell 0.4 m away spans 13 pixels, its centre may be off the ray by half of them.
    const int reach = 1 + static_cast<int>(std::ceil(depth_focal * 0.0071 / p.z()));
    for (int y = std::max(0, v - reach); y <= std::min<int>(depth_height - 1, v + reach); ++y)
      for (int x = std::max(0, u - reach); x <= std::min<int>(depth_width - 1, u + reach); ++x)
        if (readings[i].labels[y * depth_width + x] == face.id) return true;
  }
  return false;
}

TEST(VisibleCells, EachIsInSightOfSomeScan) {
  const Recording recording(options_of("office", "depth", 5));
  std::vector<Readings> readings;
  for (std::size_t i = 0; i < recording.size(); ++i) readings.push_back(recording.ideal(i));
  const evaluation::Truth truth = recording.truth();
  std::size_t cells = 0, checked = 0;
  for (const auto& face : truth.faces)
    for (const auto& run : face.visible)
      for (int c = run.column; c < run.column + run.count; ++c) {
        if (++cells % 97 != 0) continue;
        ++checked;
        const Eigen::Vector3d point =
            face.T_map_face * Eigen::Vector3d((c + 0.5) * truth.cell, (run.row + 0.5) * truth.cell, 0);
        ASSERT_TRUE(in_sight(recording, readings, face, point))
            << face.name << " cell " << c << ", " << run.row;
      }
  EXPECT_GT(checked, 500u);
}

// At 4 m on the floor a 1 cm cell is smaller than a pixel; the gaps between pixels count as seen.
TEST(VisibleCells, HaveNoGapsBetweenPixels) {
  const Recording recording(options_of("room", "depth", 1));
  const evaluation::Truth truth = recording.truth();
  const auto largest =
      std::max_element(truth.faces.begin(), truth.faces.end(),
                       [](const auto& a, const auto& b) { return a.visible_area_m2 < b.visible_area_m2; });
  ASSERT_GT(largest->visible_area_m2, 0.5);
  // One view of one face: rows are broken by what stands before it, not by sampling.
  const auto rows = static_cast<double>(largest->visible.back().row - largest->visible.front().row + 1);
  EXPECT_LT(static_cast<double>(largest->visible.size()) / rows, 6);
}

}  // namespace
}  // namespace octosurf::simulation
