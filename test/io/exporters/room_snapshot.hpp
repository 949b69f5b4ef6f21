#pragma once

#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::test {

inline Ring2 box_ring(double u, double v, double width, double height) {
  return {{u, v}, {u + width, v}, {u + width, v + height}, {u, v + height}};
}

inline Ring2 hole_ring(double u, double v, double width, double height) {
  return {{u, v}, {u, v + height}, {u + width, v + height}, {u + width, v}};
}

/// A snapshot put together by hand, each surface with a known frame, area and bounds.
class SnapshotBuilder {
 public:
  /// `x_axis` and `normal` are unit vectors at right angles.
  void add(const Eigen::Vector3d& origin, const Eigen::Vector3d& x_axis, const Eigen::Vector3d& normal,
           std::vector<Polygon> polygons, double area_m2) {
    Surface surface;
    surface.id = static_cast<SurfaceId>(3 * snapshot_.surfaces.size() + 2);
    const auto hue = static_cast<float>(surface.id % 7) / 6;
    surface.color = {0.25f + 0.6f * hue, 0.85f - 0.5f * hue,
                     0.3f + 0.5f * static_cast<float>(surface.id % 4) / 3};
    surface.plane = {normal, normal.dot(origin)};
    surface.T_map_surface.linear() << x_axis, normal.cross(x_axis), normal;
    surface.T_map_surface.translation() = origin;
    surface.polygons = std::move(polygons);
    for (const Polygon& polygon : surface.polygons) {
      for (const Eigen::Vector2d& uv : polygon.outer) surface.boundary.push_back(surface.to_map(uv));
      for (const Ring2& hole : polygon.holes) {
        for (const Eigen::Vector2d& uv : hole) surface.boundary.push_back(surface.to_map(uv));
      }
    }
    surface.area_m2 = area_m2;
    const auto n = static_cast<double>(surface.id);
    surface.inliers = 100 * surface.id;
    surface.rms_m = 0.001 * n;
    surface.covariance << 4e-6 * n, 1e-6 * n, 0, 1e-6 * n, 4e-6 * n, 0, 0, 0, 1e-6 * n;
    surface.revision = 10 + surface.id;
    if (surface.id > 4) surface.parents = {1, 4};
    snapshot_.surfaces.push_back(std::make_shared<const Surface>(std::move(surface)));
  }

  /// Axis-aligned box, seen from outside, without its bottom.
  void add_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                          z = Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d size = high - low;
    add({low.x(), low.y(), high.z()}, x, z, {{box_ring(0, 0, size.x(), size.y()), {}}}, size.x() * size.y());
    add(low, x, -y, {{box_ring(0, 0, size.x(), size.z()), {}}}, size.x() * size.z());
    add({high.x(), high.y(), low.z()}, -x, y, {{box_ring(0, 0, size.x(), size.z()), {}}},
        size.x() * size.z());
    add({high.x(), low.y(), low.z()}, y, x, {{box_ring(0, 0, size.y(), size.z()), {}}}, size.y() * size.z());
    add({low.x(), high.y(), low.z()}, -y, -x, {{box_ring(0, 0, size.y(), size.z()), {}}},
        size.y() * size.z());
  }

  Snapshot take() {
    snapshot_.revision = 812;
    snapshot_.resolution = 0.02;
    return std::move(snapshot_);
  }

 private:
  Snapshot snapshot_;
};

/// 6 × 4 × 2.5 m: a floor with a hole under the table, ceiling, four walls (one with a window and an
/// island of its own), a table, a stair of four steps, and a pillar. 0 ≤ x ≤ 6, 0 ≤ y ≤ 4, 0 ≤ z ≤ 2.5.
inline Snapshot make_room() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  SnapshotBuilder room;
  room.add({0, 0, 0}, x, z, {{box_ring(0, 0, 6, 4), {hole_ring(2, 1.5, 0.8, 0.6)}}}, 24 - 0.48);
  room.add({0, 4, 2.5}, x, -z, {{box_ring(0, 0, 6, 4), {}}}, 24);
  room.add({6, 0, 0}, -x, y, {{box_ring(0, 0, 6, 2.5), {}}}, 15);
  room.add({0, 4, 0}, x, -y,
           {{box_ring(0, 0, 6, 2.5), {hole_ring(3, 0.8, 1.5, 1.2)}}, {box_ring(3.5, 1.2, 0.4, 0.4), {}}},
           15 - 1.8 + 0.16);
  room.add({0, 0, 0}, y, x, {{box_ring(0, 0, 4, 2.5), {}}}, 10);
  room.add({6, 4, 0}, -y, -x, {{box_ring(0, 0, 4, 2.5), {}}}, 10);
  room.add_box({1.6, 1.2, 0.7}, {3.2, 2.2, 0.75});
  for (int step = 0; step < 4; ++step) {
    room.add_box({4.4 + 0.3 * step, 2.8, 0}, {4.7 + 0.3 * step, 4, 0.18 * (step + 1)});
  }
  Snapshot snapshot = room.take();
  Cylinder pillar;
  pillar.id = 3;
  pillar.axis_point = {5, 1, 1.25};
  pillar.radius_m = 0.125;
  pillar.length_m = 2.5;
  pillar.start = {0, -1, 0};
  pillar.span_rad = std::numbers::pi / 2;
  pillar.inliers = 1234;
  pillar.rms_m = 0.002;
  pillar.revision = 17;
  snapshot.cylinders.push_back(std::make_shared<const Cylinder>(pillar));
  return snapshot;
}

}  // namespace octosurf::test
