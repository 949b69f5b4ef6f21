#pragma once

#include "planning/shapes.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <filesystem>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <unistd.h>
#include <vector>

#include <octosurf/planner_formats.hpp>

namespace octosurf::test {

/// A folder of its own, and surfaces put together by hand.
class PlannerFormats : public ::testing::Test {
 protected:
  PlannerFormats() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("octosurf_planner_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  ~PlannerFormats() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }

  std::filesystem::path folder_;
};

inline ConvexPiece piece_on(const PlannerSurface& surface, const Ring2& ring) {
  ConvexPiece piece;
  for (const Eigen::Vector2d& uv : ring)
    piece.vertices.push_back(surface.T_world_surface * Eigen::Vector3d(uv.x(), uv.y(), 0));
  return piece;
}

/// Monotone chain, counter-clockwise.
inline Ring2 convex_hull(Ring2 points) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  const auto half = [](const Ring2& from) {
    Ring2 chain;
    for (const Eigen::Vector2d& p : from) {
      const auto turns_left = [&] {
        const Eigen::Vector2d a = chain.back() - chain[chain.size() - 2], b = p - chain.back();
        return a.x() * b.y() - a.y() * b.x() > 0;
      };
      while (chain.size() > 1 && !turns_left()) chain.pop_back();
      chain.push_back(p);
    }
    chain.pop_back();
    return chain;
  };
  Ring2 hull = half(points);
  std::reverse(points.begin(), points.end());
  const Ring2 back = half(points);
  hull.insert(hull.end(), back.begin(), back.end());
  return hull;
}

inline Ring2 random_convex(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> coordinate(-size, size);
  Ring2 points(3 + random() % 20);
  for (Eigen::Vector2d& point : points) point = {coordinate(random), coordinate(random)};
  return convex_hull(points);
}

/// With its normal tilted by `tilt_rad` towards a random direction, some metres from the origin.
inline PlannerSurface random_surface(std::mt19937_64& random, SurfaceId id, double tilt_rad) {
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi), place(-8, 8);
  const double towards = angle(random);
  const Eigen::Vector3d axis(std::cos(towards), std::sin(towards), 0);
  PlannerSurface surface;
  surface.id = id;
  surface.T_world_surface.linear() =
      (Eigen::AngleAxisd(tilt_rad, axis) * Eigen::AngleAxisd(angle(random), Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  surface.T_world_surface.translation() = Eigen::Vector3d(place(random), place(random), place(random));
  return surface;
}

/// A level square table of 2 m with a square hole of 0.4 m in its middle, its inset by 0.1 m in four pieces,
/// and an island of 0.2 m in the hole on which there is no room.
inline PlannerSurface table_with_hole(SurfaceId id) {
  using shapes::box;
  PlannerSurface table;
  table.id = id;
  table.T_world_surface.translation() = Eigen::Vector3d(3, -2, 0.75);
  table.polygons = {{box(0, 0, 2, 2), {shapes::reversed(box(0.8, 0.8, 0.4, 0.4))}},
                    {box(0.9, 0.9, 0.2, 0.2), {}}};
  table.insets = {{box(0.1, 0.1, 1.8, 1.8), {shapes::reversed(box(0.7, 0.7, 0.6, 0.6))}}};
  for (const Ring2& ring :
       {box(0.1, 0.1, 1.8, 0.6), box(0.1, 1.3, 1.8, 0.6), box(0.1, 0.7, 0.6, 0.6), box(1.3, 0.7, 0.6, 0.6)})
    table.pieces.push_back(piece_on(table, ring));
  return table;
}

}  // namespace octosurf::test
