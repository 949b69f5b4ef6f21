#pragma once

#include "support/scene.hpp"

namespace octosurf::test {

/// A round bar: the lateral surface of a cylinder from `from` to `to`; visible from outside.
struct Bar {
  Eigen::Vector3d from, to;
  double radius;

  Eigen::Vector3d axis() const { return (to - from).normalized(); }
  std::optional<double> meet(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) const {
    const auto square = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
      return v - axis().dot(v) * axis();
    };
    const Eigen::Vector3d d = square(direction), o = square(eye - from);
    const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - radius * radius;
    if (a < 1e-12 || b * b < a * c) return {};
    const double range = (-b - std::sqrt(b * b - a * c)) / a;
    const double height = axis().dot(eye + range * direction - from);
    if (range <= 0 || height < 0 || height > (to - from).norm()) return {};
    return range;
  }
};

struct Ball {
  Eigen::Vector3d centre;
  double radius;

  std::optional<double> meet(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d o = eye - centre;
    const double b = o.dot(direction), c = o.squaredNorm() - radius * radius;
    if (b * b < c) return {};
    const double range = -b - std::sqrt(b * b - c);
    if (range <= 0) return {};
    return range;
  }
};

/// Rectangles, bars and balls to cast rays at.
struct RoundScene {
  Scene flat;
  std::vector<Bar> bars;
  std::vector<Ball> balls;

  std::optional<double> cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
    std::optional<double> nearest = flat.cast(from, direction);
    const auto meet = [&](const auto& thing) {
      if (const auto range = thing.meet(from, direction); range && (!nearest || *range < *nearest))
        nearest = range;
    };
    std::for_each(bars.begin(), bars.end(), meet);
    std::for_each(balls.begin(), balls.end(), meet);
    return nearest;
  }
};

}  // namespace octosurf::test
