#include "detection/replace_surfaces.hpp"

#include "detection/segment.hpp"
#include "detection/write_surfaces.hpp"

namespace octosurf::detection {

void replace_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree) {
  const Readings readings(octree, ledger.window, ledger.noise);
  const Segmentation found = segment(readings, limits_of(ledger.parameters));
  for (const SurfaceId id : write_surfaces(ledger, readings, found, Planes::all))
    if (id != 0) ledger.find(id)->set_checked();
  ledger.changes.requeued.clear();
}

}  // namespace octosurf::detection
