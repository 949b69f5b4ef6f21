#pragma once

#include <octosurf/surface.hpp>

namespace octosurf {

/// Whether everything in `before` is in `after` or has left it since, and nothing else is as old: `after` is
/// the same map later.
bool goes_on_from(const Snapshot& after, const Snapshot& before);

/// A loaded map's snapshot with its octree, as compare_maps() reads it.
Snapshot with_octree(Snapshot snapshot, const OccupancyView& octree);

}  // namespace octosurf
