#pragma once

#include "surfaces/map_view.hpp"

#include <span>
#include <vector>

namespace octosurf::cylinders {

/// Points without a plane.
struct LeftOver {
  std::vector<std::vector<PointId>> regions;  ///< smooth ones, key order each
  std::vector<PointId> points;                ///< pending
};

/// `points` and, around `seeds`, the smooth regions of pending points; both are pending. Points seen
/// *through* a surface are its noise, because surfaces are opaque, and are in no region.
LeftOver left_over(const surfaces::MapView& map, std::vector<PointId> points, std::span<const PointId> seeds);

}  // namespace octosurf::cylinders
