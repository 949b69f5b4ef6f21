#pragma once

#include "detection/detector.hpp"
#include "geometry/disjoint_sets.hpp"

#include <functional>
#include <map>
#include <vector>

namespace octosurf::detection {

/// Divides a part into some that do not touch: points in adjacent cubes as wide as h and a cell are in one
/// part, and so are the inliers of a surface; small parts are put together. The result depends on nothing
/// else. O(points).
std::vector<Part> divided(const surfaces::MapView& map, const Part& part);

/// Calls look(k, view, parts[k]) for each part of a map, in parallel: in the thread's view, with the part's
/// points as there.
using LookAtPart = std::function<void(std::size_t, const surfaces::MapView&, const Part&)>;
void look_at_parts(const surfaces::MapView& map, const std::vector<Part>& parts, int threads,
                   const LookAtPart& look);

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
