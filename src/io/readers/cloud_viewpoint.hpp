#pragma once

#include <Eigen/Core>
#include <optional>

#include <octosurf/scan.hpp>

namespace octosurf::io {

/// Probable viewpoint of a cloud without one.
struct CloudViewpoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< the cloud's frame, m: above it
  double hidden = 0;         ///< share of its readings that lie behind others, seen from straight above
  double hidden_origin = 0;  ///< the same, seen from the origin
};

/// A sensor gives one reading in each direction, so in its own frame no reading lies behind another seen from
/// the origin; in composed or transformed clouds many do. Such a cloud was most likely seen from above, as
/// walkable ground is. Empty for a cloud that may have been seen from the origin. O(n log n).
std::optional<CloudViewpoint> likely_viewpoint(const Scan& cloud);

}  // namespace octosurf::io
