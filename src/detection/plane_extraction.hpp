#pragma once

#include "geometry/planarity.hpp"
#include "surfaces/map_view.hpp"
#include "surfaces/refusal.hpp"

#include <optional>
#include <span>
#include <vector>

namespace octosurf::detection {

class RegionPoints;

/// A plane through some of a region's points, and whether it is to become a surface.
struct PlaneProposal {
  Plane plane;                                        ///< without meaning if the points span none
  std::vector<occupancy::PointWindow::Index> points;  ///< never empty
  std::optional<surfaces::Refusal> refusal;           ///< empty: it is to become one
};

/// Planes out of one smooth region (paper III-C4).
///
/// While more than n points remain: RANSAC (Fischler & Bolles 1981) with s and at most 200
/// iterations, the plane refitted to its inliers; inliers split into Euclidean clusters by h; every
/// cluster of at least n points that is wide enough, flat (no cylinder's facet) and no noise sheet of
/// a surface beside it becomes a surface. With `aligned_angle` below 90° inliers' normals must agree
/// with the plane's (the paper's "normal-aligned" variant). Random numbers depend on the region only.
class PlaneExtraction {
 public:
  using Index = occupancy::PointWindow::Index;

  /// `region`: in key order.
  PlaneExtraction(const surfaces::MapView& map, std::vector<Index> region);

  /// The next proposal, until each point of the region has been in one. A proposal that is not refused has to
  /// be made a surface before the next call, whose proposal is compared with it.
  std::optional<PlaneProposal> next();

 private:
  struct Verdict {
    std::optional<surfaces::Refusal> refusal;
    bool bends = false;  // the cluster by itself
  };

  std::optional<PlaneProposal> divide();
  std::optional<Plane> best_plane(std::span<const Index> points, const RegionPoints& all);
  std::vector<Index> inliers_of(std::span<const Index> region, const RegionPoints& points,
                                const Plane& plane);
  geometry::Planarity planarity_of(std::span<const Index> cluster, const Plane& plane);
  PlaneProposal judged(std::vector<Index> cluster);
  std::optional<surfaces::Refusal> refusal_by_width(std::span<const Index> cluster, const Plane& plane);
  std::optional<surfaces::Refusal> refusal_by_view(std::span<const Index> cluster, const Plane& plane);
  Verdict verdict_on_shape(std::span<const Index> cluster, const Plane& plane);

  const surfaces::MapView& map_;
  const Parameters& parameters_;
  std::size_t min_points_;
  bool robust_;  // Parameters::aligned(); else the paper's planes
  float cos_aligned_;
  std::vector<Index> region_;                 // points that no plane has been found for yet
  Plane plane_;                               // the last one found
  std::vector<std::vector<Index>> clusters_;  // of its inliers, not proposed yet; in reverse order
  bool plane_bends_ = false;                  // its inliers together
  bool cluster_bends_ = false;                // one of the region's clusters
};

}  // namespace octosurf::detection
