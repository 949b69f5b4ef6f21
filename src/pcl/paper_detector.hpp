#pragma once

#include "detection/detector.hpp"

namespace octosurf::pcl {

/// W. Pryor's detector from PCL's own parts (steps.hpp). Decisions that the paper leaves open, or that
/// incremental updates require:
///
/// - All points are in key order, which determines RANSAC's draws.
/// - III-B: surfaces by size, ties by id. Inside a polygon: by the even-odd rule over all rings.
/// - III-B2 expands from inliers at the outline's vertices, which the plane's hash finds, into new points,
///   which the octree finds.
/// - III-C1: points removed by the radius filter are pending and not retried; explain() says "isolated".
/// - III-C4: planes are RANSAC's, and never refitted.
/// - Changes remove points as for any detector; a surface with fewer than n is dissolved.
///
/// Cost: all waiting points go through moving least squares with each scan; all outline vertices of surfaces
/// within h of new points are visited.
class PaperDetector final : public detection::Detector {
 public:
  PaperDetector() : Detector({.refits = false, .outlines_decide = true}) {}

  using Assignment = detection::Assignment;
  using MapView = surfaces::MapView;
  using Proposal = detection::Proposal;

  std::vector<Assignment> add_inliers(const MapView& map, std::span<const PointId> fresh) const override;
  std::vector<Assignment> expand(const MapView& map, std::span<const PointId> fresh, int) const override;
  detection::Due due(const MapView& map, const surfaces::PendingQueue& queue, std::span<const PointId> fresh,
                     std::optional<std::uint64_t> turn) const override;
  std::optional<Proposal> segment(const MapView& map, const detection::Part& part, int) const override;
  std::map<PointId, surfaces::Refusal> refusals(const MapView& map,
                                                std::span<const PointId> pending) const override;
};

}  // namespace octosurf::pcl
