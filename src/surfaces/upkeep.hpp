#pragma once

#include "surfaces/scan_changes.hpp"

#include <span>

namespace octosurf {

/// Takes vanished voxels out of their surfaces, carries refined points over (those that no longer
/// fit go back to pending), and dissolves surfaces that fell below n. Cost follows the delta.
void retract(Workspace& work, const OccupancyDelta& delta);

/// Adds repeated observations of inlier voxels to each surface's moments. It counts points, not voxels, but
/// at most eight in a voxel, because a sensor's neighbouring readings have errors in common. A surface that
/// got nothing but evidence is not refitted before something else touches it.
void accumulate_evidence(Workspace& work, const VoxelScan& scan,
                         std::span<const OccupancyDelta::Confirmed> confirmed);

/// Refits the touched surfaces' planes from their running moments (weights 1/σ²). Where a plane
/// has moved by more than a quarter of s since its inliers were last checked, they are checked
/// again and misfits go back to pending. Dissolves what falls below n. A surface that has changed by a
/// quarter is also checked for being one plane: if it bends, has become too narrow or is the noise of another
/// surface (soundness.hpp) it is dissolved, and Changes::unsound has the reason; if it is several planes it
/// is split (parts.hpp).
void refit(Workspace& work);

/// Merges `from` into `into`: inliers, moments, lineage. `from` ceases to exist.
void merge(Workspace& work, SurfaceModel& into, SurfaceModel& from);

/// One plane explains both (one_plane in parts.hpp), and their normals are within 10°. `contact`: where
/// they meet, map frame.
bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const Eigen::Vector3d& contact,
              const NoiseModel& noise);

/// A joint plane fits both: it raises the rms distance of each by a third of s at most. Poses that drift
/// between visits leave the pieces of one surface that far apart. For surfaces that touch along most of the
/// smaller one's width.
bool joint_plane_fits(const SurfaceModel& a, const SurfaceModel& b, const NoiseModel& noise);

/// Recomputes what is stale of the touched surfaces and publishes a new snapshot.
void derive(Workspace& work);

}  // namespace octosurf
