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
  inverse,        ///< T_sensor_map
  opengl,         ///< of a camera that looks along −z with y up
  opengl_inverse  ///< both: a view matrix
};
/// By PoseForm, as `map --pose-form` accepts them.
inline constexpr std::array<const char*, 4> pose_form_names{"as-given", "inverse", "opengl",
                                                            "opengl-inverse"};

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

 private:
  static constexpr std::size_t most_views = 12;
  struct View {
    Eigen::Isometry3d pose;
    std::vector<Eigen::Vector3f> points;
    bool camera;
  };
  double share_laid(PoseForm form, double cell) const;

  std::vector<View> views_;
};

}  // namespace octosurf
