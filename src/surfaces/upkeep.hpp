#pragma once

#include "surfaces/changes.hpp"

namespace octosurf {

/// Takes vanished voxels out of their surfaces, carries refined points over (those that no longer
/// fit go back to pending), and dissolves surfaces that fell below n. Cost follows the delta.
void retract(Workspace& work, const OccupancyDelta& delta);

/// Refits the touched surfaces' planes from their running moments (weights 1/σ²). Where a plane
/// has moved by more than a quarter of s since its inliers were last checked, they are checked
/// again and misfits go back to pending. Dissolves what falls below n.
void refit(Workspace& work);

/// Merges `from` into `into`: inliers, moments, lineage. `from` ceases to exist.
void merge(Workspace& work, SurfaceModel& into, SurfaceModel& from);

/// One plane explains both: normals within 10°, and each one's mean squared distance to the joint
/// plane is what its noise allows.
bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const NoiseModel& noise);

/// Recomputes what is stale of the touched surfaces and publishes a new snapshot.
void derive(Workspace& work);

}  // namespace octosurf
