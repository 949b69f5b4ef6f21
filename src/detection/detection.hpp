#pragma once

#include "detection/refused.hpp"
#include "surfaces/ledger.hpp"

#include <optional>
#include <span>
#include <vector>

namespace octosurf::detection {

/// What a detection run has made of the points it looked at.
struct Detection {
  std::vector<SurfaceId> born;   ///< new surfaces
  std::vector<Refused> refused;  ///< points left pending; no point is named twice
  /// What was looked at and may not have been taken: for cylinders.
  struct LeftOver {
    std::vector<std::vector<occupancy::PointWindow::Index>> regions;  ///< smooth ones, key order each
    std::vector<occupancy::PointWindow::Index> points;                ///< that waited for detection
  } left_over;
};

/// New surface detection (paper III-C, Algorithm 2) on points that no surface has taken.
///
/// Runs once `accumulated` (new or requeued pending points) holds at least n points; until then there is no
/// result. It starts from those, looks at the older pending points around them, and leaves the rest alone:
/// its cost follows the change, not the size of the pending set.
///
/// Points that were seen *through* a surface are its noise, because surfaces are opaque. They stay pending;
/// otherwise they would make parallel surfaces behind far walls.
std::optional<Detection> detect(surfaces::Ledger& ledger, std::span<const geometry::VoxelKey> accumulated);

/// The same from these pending points on, however few. `refused` does not name points that have no normal,
/// are not flat or were seen through a surface (seen_through.hpp).
Detection detect_from(surfaces::Ledger& ledger, std::vector<occupancy::PointWindow::Index> waiting);

/// What surfaces that were looked for by other rules have left over for cylinders: `points`, which are
/// pending, and the smooth regions around `seeds`.
Detection::LeftOver left_over_of(const surfaces::MapView& map,
                                 std::vector<occupancy::PointWindow::Index> points,
                                 std::span<const occupancy::PointWindow::Index> seeds);

}  // namespace octosurf::detection
