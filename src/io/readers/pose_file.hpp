#pragma once

#include "io/readers/trajectory.hpp"

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::io {

/// A pose as in a file, unchecked.
struct FilePose {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  std::optional<double> stamp_s;
  std::string where;                             ///< "file:line"
  std::optional<Eigen::Quaterniond> rotation{};  ///< that T is of; empty: a matrix
};

struct PoseFile {
  std::filesystem::path file;
  std::vector<FilePose> poses;
  bool stamped = false;              ///< every pose has a time stamp
  bool kitti = false;                ///< 3×4 in one line
  bool w_first = false;              ///< with qw before qx, by its heading
  std::vector<std::string> notes{};  ///< its times' unit, if it is not s; how many poses were left out
};

/// The formats of open_scans(). Throws Error(data) with the line for anything else, including an
/// empty file and a change of format. Time stamps are in seconds, whatever the file has, and may be not
/// finite.
PoseFile read_poses(const std::filesystem::path& file);

/// Whether it is a rigid motion up to rounding, at a finite time if it has one.
bool is_good(const FilePose& pose);

/// Converts time stamps of one clock from nanoseconds, microseconds or milliseconds since 1970 to seconds and
/// returns the unit's name; empty: by their size they are in seconds.
std::string to_seconds(std::vector<double>& stamps);
/// The same of all that have a stamp.
template <class Stamped>
std::string convert_stamps(std::vector<Stamped>& all) {
  std::vector<double> stamps;
  for (const Stamped& one : all) stamps.push_back(*one.stamp_s);
  std::string unit = to_seconds(stamps);
  for (std::size_t i = 0; i < all.size(); ++i) all[i].stamp_s = stamps[i];
  return unit;
}

/// "stamp tx ty tz qx qy qz qw", as in TUM's trajectories; reading it back gives the same pose up to
/// rounding.
std::string tum_line(double stamp_s, const Eigen::Isometry3d& T);

/// The pose with an exactly orthonormal rotation; throws Error(data) naming `where` unless it is rigid up to
/// rounding (require_rigid).
Eigen::Isometry3d rigid(const Eigen::Isometry3d& T, const std::string& where);

/// Translation and quaternion; for a quaternion farther than 1e-2 from unit length the matrix is one that
/// rigid() rejects.
Eigen::Isometry3d pose_from(const Eigen::Vector3d& translation, const Eigen::Quaterniond& q);

/// Of the 12 numbers of a 3×4, row by row, at least.
Eigen::Isometry3d pose_from_rows(const std::vector<double>& values);

/// By the poses' time stamps, which all have. Throws Error(data) with the line of a bad one.
Trajectory trajectory_of(const std::vector<FilePose>& poses);

}  // namespace octosurf::io
