#pragma once

#include "occupancy/point_window.hpp"

#include <functional>
#include <span>

namespace octosurf {

/// Why detection leaves points pending.
enum class Refusal {
  isolated,          ///< fewer than two pending neighbours within r
  seen_through,      ///< behind a surface, on the line of sight
  small_region,      ///< measured points hang together smoothly, n needed
  no_plane,          ///< no three points span one
  few_on_plane,      ///< measured points of the region lie on its best plane, n needed
  small_cluster,     ///< measured points on the plane hang together by h, n needed
  few_left,          ///< measured points are left of the region beside its planes, n needed
  narrow,            ///< width in m, min_surface_width needed
  bent,              ///< a curved patch, or what lies beside one in the region
  scattered,         ///< rms of distance / σ, at most the limit
  few_for_range,     ///< measured points, more than n needed where noise is large
  normals_disagree,  ///< share of points whose own normal agrees, more than the limit needed
  noise_sheet        ///< mostly within the noise of a larger surface beside it
};

struct Refused {
  Refusal why;
  std::span<const PointWindow::Index> points;
  double measured = 0, limit = 0;  ///< what Refusal says of them; both 0: there is no number
  SurfaceId surface = 0;           ///< the one that stands in the way, if one does
};

/// Told of everything that detection refuses, as it happens. Of what is told of one point, the first
/// is the reason.
using RefusalSink = std::function<void(const Refused&)>;

}  // namespace octosurf
