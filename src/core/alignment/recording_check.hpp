#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <octosurf/deskew.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// What a recording's poses, stamps and readings may mean.
enum class Meaning {
  as_given,        ///< poses are T_map_sensor; cameras look along z with y down, lidars along x with z up
  inverse,         ///< poses are T_sensor_map
  opengl,          ///< of a camera that looks along −z with y up
  opengl_inverse,  ///< both: a view matrix
  w_first,         ///< quaternions qw qx qy qz, read as qx qy qz qw
  of_camera,       ///< of a camera, x right and y down, on the body of a lidar, x forward and z up (KITTI)
  of_body,         ///< of a body, x forward and z up, with a camera's readings, x right and y down
  mirrored_x,      ///< the readings' x axis is reversed
  mirrored_y,      ///< their y axis is: an image upside down, or a left-handed frame
  late,            ///< poses of `value` s after the stamps fit
  scale,           ///< readings are `value` times too long for the poses
  focal,           ///< a camera's focal length is `value` times too long
  turned_x,        ///< the sensor is turned against its poses by `value` rad about its x axis
  turned_y,
  turned_z
};
/// By Meaning. The first ones are forms of poses, as `map --pose-form` accepts them.
inline constexpr std::array<const char*, 15> meaning_names{
    "as-given",   "inverse", "opengl", "opengl-inverse", "w-first",  "of-camera", "of-body", "mirrored-x",
    "mirrored-y", "late",    "scale",  "focal",          "turned-x", "turned-y",  "turned-z"};
inline constexpr std::size_t pose_forms = 7;

/// T_map_sensor of a pose in that form; of other meanings the pose as it is.
Eigen::Isometry3d pose_from(Meaning form, const Eigen::Isometry3d& pose);

/// Checks whether scans, interpreted otherwise than as given, match those before them far better. Looks at
/// nothing but scans: a map that was made of them already has their errors.
class RecordingCheck {
 public:
  /// `scan` as read. Keeps readings of at most 24 views, spread over the way, and all poses.
  void add(const Scan& scan);
  /// Of a new place or direction, also those that are no longer kept.
  std::size_t views() const { return taken_; }
  /// From so many views on, forms and units can be judged.
  static constexpr std::size_t enough_views = 12;

  /// The form that fits, if different from the given one. O(readings kept).
  std::optional<Meaning> better_form() const;
  /// How many times too long the readings are for the poses, if clearly: a ratio of units. O(readings kept).
  std::optional<double> better_scale() const;

  struct Finding {
    Meaning meaning = Meaning::as_given;
    double value = 0;                ///< its unit is the meaning's
    double share = 0, as_given = 0;  ///< of the readings that lie where earlier views saw something
  };
  /// The one meaning by which scans fit far better, if any does; some 0.1 s.
  std::optional<Finding> better_meaning() const;

 private:
  /// A scan's readings.
  struct Part {
    double stamp_s;
    Eigen::Isometry3d pose;
    std::vector<Eigen::Vector3f> points;
  };
  /// From nearly one place: one scan, or lines of one after another.
  using View = std::vector<Part>;
  /// m, the median of the readings' ranges; 0: no readings.
  double usual_range() const;
  /// Where the sensor would have been; empty: not known.
  std::optional<Eigen::Isometry3d> pose_of(const Part& part, Meaning meaning, double value) const;
  /// Share of a view's readings, one in `thin` of them, that lie within a cell or two of what earlier views
  /// saw.
  struct Laid {
    double mean = 0, median = 0;  ///< over the views; where poses jump, only the first after it matches none
  };
  Laid share_laid(Meaning meaning, double value, double cell, std::size_t thin = 1) const;
  /// Share of a view's readings before what the view before saw in their direction: its rays went through
  /// them. The views' median.
  double share_seen_through(double scale = 1) const;

  std::vector<View> views_;
  std::vector<StampedPose> poses_;  // of all scans
  std::size_t taken_ = 0, every_ = 1;
  bool keeps_ = false;  // the view that is being taken
  std::size_t open_readings_ = 0;
  Eigen::Isometry3d place_ = Eigen::Isometry3d::Identity();  // of the last view taken
  bool cameras_ = true, ascending_ = true;
};

}  // namespace octosurf::alignment
