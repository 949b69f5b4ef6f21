#pragma once

#include "surfaces/map_view.hpp"
#include "surfaces/refusal.hpp"

#include <optional>
#include <span>

namespace octosurf::surfaces {

/// Checks of points before they become a surface, and of a surface when it has changed.

/// Points that lie over a larger surface that faces the same way, within the reach of its noise and of poses
/// that drift between visits. A sensor would see one of the two through the other, so they cannot both be
/// there: the larger surface is kept, and these points are taken for its noise.
struct NoiseSheet {
  SurfaceId over = 0;  ///< the larger surface; 0: none
  std::vector<MapView::Index> points;
  bool has_large_share_of(std::size_t all) const { return points.size() * 10 > all * 4; }  ///< over 40 %
};
/// The noise sheet with the most of the points. `self`: the surface they belong to, 0 if to none.
NoiseSheet noise_sheet_in(const MapView& map, std::span<const MapView::Index> points, const Plane& plane,
                          SurfaceId self);
/// The surface that has most of the points as its noise, so that they are none of their own; 0: there is
/// none.
SurfaceId noise_sheet_over(const MapView& map, std::span<const MapView::Index> points, const Plane& plane,
                           SurfaceId self);

/// Too narrow where they lie, however far they extend: strips such as the bars of a ladder, a grating's or a
/// frame's, of which most are narrower than `min_width` (geometry::median_local_width()).
std::optional<Refusal> narrow_strips(const MapView& map, std::span<const MapView::Index> points,
                                     const Plane& plane, double min_width);

/// Plane through points, weighted by 1/σ²; normal on the side of `toward`'s.
Plane fitted(const MapView& map, std::span<const MapView::Index> points, const Plane& toward);

}  // namespace octosurf::surfaces
