#pragma once

#include "detection/detector.hpp"

namespace octosurf::pcl {

/// W. Pryor's detector from PCL's own parts (steps.hpp). Where it leaves a choice, and what a map that keeps
/// its surfaces up to date makes of it:
///
/// - All points are in key order, which decides what RANSAC draws.
/// - III-B: surfaces in order of size, equal ones of id. Inside a polygon: of all rings an odd number around.
/// - III-B2 expands from the inliers that are the outline's vertices, in what is new.
/// - III-C1: what the radius filter removes is pending and waits for nothing; explain() says "isolated".
/// - III-C4: planes are RANSAC's, and never fitted again.
/// - What changes takes points back as for any detector; a surface left with fewer than n is dissolved.
///
/// Cost: all that waits goes through moving least squares with each scan, some 20 µs a point; all inliers and
/// the outlines' vertices of surfaces within h of what is new are looked at.
class PaperDetector final : public detection::Detector {
 public:
  using Assignment = detection::Assignment;
  using MapView = surfaces::MapView;
  using VoxelKey = geometry::VoxelKey;

  std::vector<Assignment> add_inliers(const MapView& map, std::span<const VoxelKey> fresh) const override;
  std::vector<Assignment> expand(const MapView& map, std::span<const VoxelKey> left) const override;
  detection::Due due(const MapView& map, const occupancy::OccupancyMap& octree, surfaces::PendingQueue before,
                     std::span<const VoxelKey> fresh, bool all,
                     std::vector<Assignment>& expanded) const override;
  std::optional<detection::Found> detect(const MapView& map, const occupancy::OccupancyMap& octree,
                                         std::span<const VoxelKey> due,
                                         std::span<const Assignment> expanded) const override;
  std::optional<detection::Found> revise(const MapView& map, const occupancy::OccupancyMap& octree,
                                         const std::set<SurfaceId>& changed) const override;
  std::vector<std::pair<SurfaceId, Plane>> fit(const MapView& map,
                                               const std::set<SurfaceId>& surfaces) const override;
  bool outlines_inliers_alone() const override { return true; }
  detection::Found detect_anew(const MapView& map, const occupancy::OccupancyMap& octree) const override;
  std::map<VoxelKey, surfaces::Refusal> refusals(const MapView& map, const occupancy::OccupancyMap& octree,
                                                 std::span<const VoxelKey> pending) const override;
};

}  // namespace octosurf::pcl
