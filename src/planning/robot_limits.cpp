// What of a robot ground depends on: the limits of its feet's contacts.
#include <octosurf/footsteps.hpp>

namespace octosurf {
namespace {

// m, half a voxel of 2 cm: the accuracy of outlines and voxels. As an edge margin: outlines extend up to a
// voxel beyond the true edge (contact.hpp), so with half a voxel a sole overhangs by at most the other half,
// a centimetre, which is tolerable. A whole voxel would avoid overhang, but leave no foothold on treads below
// 0.26 m; on simulated stairs, stones and rubble plans were as safe with either.
constexpr double half_voxel = 0.01;

// m: from there a swinging foot is lowered, so space under it must be known. Higher up swings are checked.
constexpr double usual_lift = 0.10;

ContactLimits usual_limits(double room_m) {
  ContactLimits limits;
  limits.edge_margin_m = half_voxel;
  limits.obstacle_margin_m = half_voxel;
  limits.clearance_m = room_m;
  limits.unknown_to_m = usual_lift;
  return limits;
}

}  // namespace

ContactLimits Biped::limits() { return usual_limits(0.45); }

ContactLimits Quadruped::limits() { return usual_limits(0.20); }

}  // namespace octosurf
