#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include <octosurf/scan_source.hpp>

namespace octosurf::io {

/// Sets readings of `scan`, whose sensor is known, that stand for no return to NaN: a format's largest
/// numbers, and options.no_return. `depth_image`: it comes from one.
void drop_no_returns(Scan& scan, bool depth_image, const ScanSourceOptions& options);

/// Sets the readings in these boxes, which are the robot's own, to NaN; returns their number. `sensor_in`:
/// T_frame_sensor at the scan's time.
std::size_t erase_own(Scan& scan, std::span<const SelfBox> boxes,
                      const std::function<Eigen::Isometry3d(const std::string& frame)>& sensor_in);

/// Probable viewpoint of a cloud without one.
struct CloudViewpoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< the cloud's frame, m: above it
  double hidden = 0;         ///< share of its readings that lie behind others, seen from straight above
  double hidden_origin = 0;  ///< the same, seen from the origin
};

/// In a sensor's own frame no reading lies behind another seen from the origin; in composed or transformed
/// clouds many do: these were most likely seen from above. Empty for one that may have been seen from the
/// origin.
std::optional<CloudViewpoint> likely_viewpoint(const Scan& cloud);

}  // namespace octosurf::io
