#pragma once

#include "check/recording.hpp"

#include <Eigen/Geometry>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::check {

/// How the numbers of a recording are read. The default: as `map` reads them.
struct Meaning {
  enum class Rotation { as_given, inverse_pose, transposed, w_first };
  enum class Reading {
    points,
    range,          ///< a camera's depths are distances from its centre
    inverse_depth,  ///< depth is `constant` over it
    in_map          ///< points lie in the map already; poses say where they were seen from
  };

  // Of the readings.
  Reading reading = Reading::points;
  double constant = 1;
  bool mirrored = false;  ///< their y axis
  double readings_scale = 1;
  double focal = 1;                                 ///< factor of a camera's focal length
  Eigen::Vector2d aside = Eigen::Vector2d::Zero();  ///< of its axis, focal lengths by which readings move
  std::optional<double> no_return;                  ///< range or depth that stands for none, m
  // Of the poses, in this order.
  double late = 0;  ///< scans by which poses come too late
  Rotation rotation = Rotation::as_given;
  Eigen::Matrix3d position_axes = Eigen::Matrix3d::Identity();
  double pose_scale = 1;
  Eigen::Matrix3d sensor_axes = Eigen::Matrix3d::Identity();
  Eigen::Isometry3d mount = Eigen::Isometry3d::Identity();
  // Of the scans.
  bool without_odd = false;                                             ///< those that stand out are left out
  std::size_t first_session = std::numeric_limits<std::size_t>::max();  ///< scans in it

  /// Where scan `index` was taken; empty: it has no pose.
  std::optional<Eigen::Isometry3d> pose_of(const Recording& recording, std::size_t index) const;
  /// A scan's readings, sensor frame.
  std::vector<Eigen::Vector3f> readings_of(const Scan& scan) const;
  /// Some scans have no pose.
  bool leaves_out(const Recording& recording) const;
  /// What no option of `map` undoes, and how to do it; empty: nothing.
  std::string by_hand() const;
  /// Whether readings are the same as by another meaning.
  bool same_readings(const Meaning& other) const;
};

/// How much of what two views have in common agrees.
struct Score {
  std::size_t places = 0, apart = 0;
  double share_apart() const {
    return places == 0 ? 1 : static_cast<double>(apart) / static_cast<double>(places);
  }
  /// Places, less four times those apart: of the worst pairs of right recordings one in five is, and little
  /// in common is little evidence.
  double evidence() const { return static_cast<double>(places) - 4 * static_cast<double>(apart); }
};

}  // namespace octosurf::check
