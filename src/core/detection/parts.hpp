#pragma once

#include "detection/detector.hpp"
#include "geometry/disjoint_sets.hpp"

#include <map>
#include <optional>
#include <vector>

namespace octosurf::detection {

/// A part of a map: one of several has a view of its own, so that threads can look at them side by side.
struct ViewedPart {
  /// `ids`: in the window of `whole`.
  ViewedPart(const surfaces::MapView& whole, const Part& ids, bool alone);

  std::optional<surfaces::LoadedView> own;
  const surfaces::MapView& map;
  Part part;
};

/// Divides a part into some that do not touch: points in adjacent cubes as wide as h and a cell are in one
/// part, and so are the inliers of a surface; small parts are put together. The result depends on nothing
/// else. O(points).
std::vector<Part> divided(const surfaces::MapView& map, const Part& part);

/// Proposals for parts of a map as one. Planes in which a surface goes on, in part after part, are one plane;
/// a point that two parts have labelled keeps the first label.
class JointProposal {
 public:
  explicit JointProposal(const surfaces::MapView& map) : map_(map) {}

  /// `from`: the window of its points. The number of readings of its `rest` is not used.
  void add(const Proposal& part, const occupancy::PointWindow& from);
  /// Without planes of fewer than n voxels, whose pending points are among the unprocessed ones.
  Proposal take() &&;

 private:
  const surfaces::MapView& map_;
  Proposal joint_;
  geometry::DisjointSets planes_{1};  // of joint_
  occupancy::PointSet labelled_;
  std::map<SurfaceId, Proposal::Label> goes_on_;
};

}  // namespace octosurf::detection
