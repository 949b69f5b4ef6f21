#pragma once

#include "detection/refused.hpp"
#include "surfaces/planarity.hpp"
#include "surfaces/scan_changes.hpp"

#include <span>
#include <vector>

namespace octosurf {

class RegionPoints;

/// Planes out of one smooth region (paper III-C4).
///
/// While more than n points remain: RANSAC (Fischler & Bolles 1981) with s and at most 200
/// iterations, the plane refitted to its inliers; inliers split into Euclidean clusters by h; every
/// cluster of at least n points that is wide enough, flat (no cylinder's facet) and no noise sheet of
/// a surface beside it becomes a surface. With `aligned_angle` below 90° inliers' normals must agree
/// with the plane's (the paper's "normal-aligned" variant). Random numbers depend on the region only.
class PlaneExtraction {
 public:
  using Index = PointWindow::Index;

  PlaneExtraction(Workspace& work, const Parameters& parameters, const RefusalSink* refusals = nullptr);

  /// Creates surfaces in the store and gives them their points; returns their ids.
  std::vector<SurfaceId> operator()(std::vector<Index> region);

 private:
  bool ransac(std::span<const Index> points, const RegionPoints& all, Plane& plane);
  std::vector<Index> inliers_of(std::span<const Index> region, const RegionPoints& points,
                                const Plane& plane);
  void make_surface(std::span<const Index> cluster, const Plane& plane, std::vector<SurfaceId>& born,
                    bool& bent);
  Planarity planarity_of(std::span<const Index> cluster, const Plane& plane);
  bool acceptable(std::span<const Index> cluster, const Plane& plane, bool& bent);
  bool wide_enough(std::span<const Index> cluster, bool bent);
  bool planar(std::span<const Index> cluster, const Plane& plane, bool& bent);
  bool refuse(const Refusal& why, std::span<const Index> points) const;  // tells and is false
  bool too_few(std::string_view what, std::span<const Index> points,
               std::size_t count) const;  // if so, tells

  Workspace& work_;
  const Parameters& parameters_;
  std::size_t fewest_;
  bool aligned_;
  bool curved_ = false;  // the plane's inliers together bend
  float cos_aligned_;
  const RefusalSink* refusals_;
};

}  // namespace octosurf
