#include "geometry/directions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <octosurf/deskew.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
namespace {

// A robot that turns at 3 rad/s turns by 0.17° in it. Poses between are interpolated by arcs to second order,
// with an error of 5e-9 of the range.
constexpr double step_s = 1e-3;
constexpr double longest_s = 3600;

[[noreturn]] void refuse(const Scan& scan, const std::string& what, const std::string& hint) {
  throw Error(Error::Kind::data, scan.name, what, hint);
}

/// A motion at constant velocity from one pose to the next, in the sensor's frame at the scan's time.
struct Arc {
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
  Eigen::Vector3f turn = Eigen::Vector3f::Zero();  // rotation vector in the first pose's frame
  Eigen::Vector3f start = Eigen::Vector3f::Zero(), way = Eigen::Vector3f::Zero();

  Arc(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b)
      : rotation(a.linear().cast<float>()),
        start(a.translation().cast<float>()),
        way((b.translation() - a.translation()).cast<float>()) {
    const Eigen::AngleAxisd turned(a.linear().transpose() * b.linear());
    turn = (turned.angle() * turned.axis()).cast<float>();
  }
  Eigen::Vector3f origin(float t) const { return start + t * way; }
  Eigen::Vector3f point(const Eigen::Vector3f& p, float t) const {
    const Eigen::Vector3f w = t * turn, moved = w.cross(p);
    return rotation * (p + moved + 0.5F * w.cross(moved)) + origin(t);
  }
};

}  // namespace

Scan deskew(Scan scan, const PoseAtTime& pose_at) {
  if (scan.times_s.empty()) return scan;
  if (scan.times_s.size() != scan.points.size())
    refuse(scan,
           std::to_string(scan.times_s.size()) + " times for " + std::to_string(scan.points.size()) +
               " readings",
           "give one to each, or none");
  const auto placed = [&](std::size_t i) {
    return scan.points[i].allFinite() && std::isfinite(scan.times_s[i]);
  };
  float first = std::numeric_limits<float>::infinity(), last = -first;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (!placed(i)) continue;
    first = std::min(first, scan.times_s[i]);
    last = std::max(last, scan.times_s[i]);
  }
  scan.origins.assign(scan.points.size(), Eigen::Vector3f::Zero());
  std::vector<Arc> arcs;
  const double span = static_cast<double>(last) - static_cast<double>(first);
  if (span > longest_s) refuse(scan, "times that span over an hour", "give them in seconds");
  const double steps = std::max(1.0, std::ceil(span / step_s));
  if (first <= last) {
    const Eigen::Isometry3d T_sensor_map = scan.T_map_sensor.inverse();
    const auto pose = [&](double step) {
      const Eigen::Isometry3d T = pose_at(scan.stamp_s + static_cast<double>(first) + span * step / steps);
      require_rigid(T, scan.name);
      return T_sensor_map * T;
    };
    Eigen::Isometry3d before = pose(0);
    for (double step = 1; step <= steps; ++step) {
      const Eigen::Isometry3d after = pose(step);
      arcs.emplace_back(before, after);
      before = after;
    }
  }
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (!placed(i)) {
      scan.points[i].setConstant(std::numeric_limits<float>::quiet_NaN());
      continue;
    }
    const double at = span > 0 ? static_cast<double>(scan.times_s[i] - first) * steps / span : 0;
    const std::size_t arc = std::min(static_cast<std::size_t>(at), arcs.size() - 1);
    const auto t = static_cast<float>(at - static_cast<double>(arc));
    scan.points[i] = arcs[arc].point(scan.points[i], t);
    scan.origins[i] = arcs[arc].origin(t);
  }
  scan.times_s.clear();
  return scan;
}

Scan deskew(Scan scan, std::span<const StampedPose> poses) {
  if (scan.times_s.empty()) return scan;
  if (poses.size() < 2) refuse(scan, "one pose or none, so that its motion is unknown", "give two or more");
  if (std::ranges::adjacent_find(poses, std::ranges::greater_equal{}, &StampedPose::stamp_s) != poses.end())
    refuse(scan, "poses whose times do not ascend", "sort them, and give one for each time");
  const std::string name = scan.name;
  return deskew(std::move(scan), [&](double stamp_s) {
    const auto after =
        std::ranges::lower_bound(poses.begin() + 1, poses.end() - 1, stamp_s, {}, &StampedPose::stamp_s);
    const StampedPose &a = *std::prev(after), &b = *after;
    const double reach = 1.001 * (b.stamp_s - a.stamp_s);  // times round
    if (!(stamp_s >= a.stamp_s - reach && stamp_s <= b.stamp_s + reach))
      throw Error(Error::Kind::data, name, "no pose at some of its readings' times",
                  "give poses from its first to its last reading");
    for (const StampedPose* pose : {&a, &b}) require_rigid(pose->T_map_sensor, name);
    return geometry::pose_between(a.T_map_sensor, b.T_map_sensor,
                                  (stamp_s - a.stamp_s) / (b.stamp_s - a.stamp_s));
  });
}

}  // namespace octosurf
