#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf {

/// Forms of a recording's poses other than T_map_sensor of a camera that looks along z with y down.
enum class PoseForm {
  as_given,
  inverse,         ///< T_sensor_map
  opengl,          ///< of a camera that looks along −z with y up
  opengl_inverse,  ///< both: a view matrix
  w_first,         ///< quaternions qw qx qy qz, read as qx qy qz qw
  of_camera        ///< of a camera, x right and y down, on the body of a lidar, x forward and z up (KITTI)
};
/// By PoseForm, as `map --pose-form` accepts them.
inline constexpr std::array<const char*, 6> pose_form_names{"as-given",       "inverse", "opengl",
                                                            "opengl-inverse", "w-first", "of-camera"};

/// T_map_sensor of a pose in that form.
Eigen::Isometry3d pose_from(PoseForm form, const Eigen::Isometry3d& pose);

/// Checks whether scans' poses, interpreted in another form, match readings far better with those of previous
/// scans.
class PoseCheck {
 public:
  /// `scan` as read. Keeps a few readings of up to 12 scans from different places.
  void add(const Scan& scan);
  /// It has enough scans.
  bool full() const { return views_.size() == most_views; }
  /// The form that fits, if different from the given one. O(readings kept).
  std::optional<PoseForm> better_form() const;
  /// How many times too long the readings are for the poses, if clearly: a ratio of units. O(readings kept).
  std::optional<double> better_scale() const;

 private:
  static constexpr std::size_t most_views = 12;
  struct View {
    Eigen::Isometry3d pose;
    std::vector<Eigen::Vector3f> points;
    bool camera;
  };
  /// A cell of the usual size, m; 0: no readings.
  double usual_cell() const;
  /// Share of the readings that lie where earlier views have seen something, with positions times `scale`.
  double share_laid(PoseForm form, double cell, double scale = 1) const;
  /// Share of the readings before what another view has seen in their direction: its rays went through them.
  double share_seen_through(double scale = 1) const;

  std::vector<View> views_;
};

}  // namespace octosurf
