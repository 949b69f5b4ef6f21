#pragma once

#include "detection/refused.hpp"
#include "surfaces/scan_changes.hpp"

#include <vector>

namespace octosurf {

/// New surface detection (paper III-C, Algorithm 2) on points that no surface has taken.
///
/// Runs once `accumulated` (new or requeued pending points) holds at least n points. It starts from
/// those, looks at the older pending points around them, and leaves the rest alone: its cost
/// follows the change, not the size of the pending set. Returns the ids of the new surfaces.
///
/// Points that were seen *through* a surface are its noise, because surfaces are opaque. They stay pending;
/// otherwise they would make parallel surfaces behind far walls.
std::vector<SurfaceId> detect(Workspace& work);

/// What a detection run has made of the points it looked at.
struct Detection {
  std::vector<SurfaceId> born;   ///< new surfaces
  std::vector<Refused> refused;  ///< points left pending; no point is named twice
};

/// The same from these pending points on, however few, whatever has accumulated. `refused` does not
/// name points that have no normal, are not flat or were seen through a surface (seen_through.hpp).
Detection detect_from(Workspace& work, std::vector<PointWindow::Index> waiting);

}  // namespace octosurf
