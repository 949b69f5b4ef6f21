// Common input of planners' formats: the surfaces, and the allowed contact positions on them.
#include <utility>

#include <octosurf/planner_formats.hpp>

namespace octosurf {

PlannerSurface turned(PlannerSurface surface, const Eigen::Quaterniond& turn) {
  surface.T_world_surface = turn * surface.T_world_surface;
  for (ConvexPiece& piece : surface.pieces)
    for (Eigen::Vector3d& vertex : piece.vertices) vertex = turn * vertex;
  return surface;
}

std::vector<PlannerSurface> planner_surfaces(const Snapshot& snapshot, const PlannerContact& contact,
                                             const OccupancyView* octree) {
  std::vector<PlannerSurface> surfaces;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    ContactRegion region =
        contact_region(*surface, contact.shape, contact.yaw_rad, contact.limits, octree, &snapshot);
    PlannerSurface one{surface->id, surface->T_map_surface, surface->polygons, {}, {}};
    one.pieces = convex_pieces(*surface, region.polygons, contact.pieces);
    one.insets = std::move(region.polygons);
    surfaces.push_back(turned(std::move(one), contact.turn));
  }
  return surfaces;
}

}  // namespace octosurf
