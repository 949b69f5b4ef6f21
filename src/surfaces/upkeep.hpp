#pragma once

#include "surfaces/scan_changes.hpp"

#include <span>

namespace octosurf {

/// Takes vanished voxels out of their surfaces, carries refined points over (those that no longer
/// fit go back to pending), and dissolves surfaces that fell below n. Cost follows the delta.
void retract(Workspace& work, const OccupancyDelta& delta);

/// Hands what the scan saw again to the surfaces as evidence of their planes. Counts points, not
/// voxels: at most eight a voxel, because a sensor's neighbouring readings err alike. Surfaces with new
/// evidence only are not refitted before something else touches them.
void confirm(Workspace& work, const VoxelScan& scan, std::span<const OccupancyDelta::Confirmed> confirmed);

/// Refits the touched surfaces' planes from their running moments (weights 1/σ²). Where a plane
/// has moved by more than a quarter of s since its inliers were last checked, they are checked
/// again and misfits go back to pending. Dissolves what falls below n. A surface that has changed by a
/// quarter is also asked again whether it is one: what bends, has become too narrow or is another's noise
/// (soundness.hpp) is dissolved, and Changes::unsound says why; what is several planes is split (parts.hpp).
void refit(Workspace& work);

/// Merges `from` into `into`: inliers, moments, lineage. `from` ceases to exist.
void merge(Workspace& work, SurfaceModel& into, SurfaceModel& from);

/// One plane explains both (one_plane in parts.hpp), and their normals are within 10°. `contact`: where
/// they meet, map frame.
bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const Eigen::Vector3d& contact,
              const NoiseModel& noise);

/// The same for surfaces that touch along most of the smaller one's width: a joint plane leaves each by a
/// third of s at most. Poses that drift between visits leave a surface's pieces that far apart.
bool grown_together(const SurfaceModel& a, const SurfaceModel& b, const NoiseModel& noise);

/// Recomputes what is stale of the touched surfaces and publishes a new snapshot.
void derive(Workspace& work);

}  // namespace octosurf
