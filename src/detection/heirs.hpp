#pragma once

#include "detection/segmentation.hpp"

#include <cstddef>
#include <map>
#include <set>
#include <vector>

namespace octosurf::detection {

/// In which labels the surfaces go on that had the readings so far.
class Heirs {
 public:
  Heirs(const Readings& readings, const Segmentation& segmentation);

  /// Surfaces that had a reading, or have a part outside.
  std::vector<SurfaceId> surfaces() const;
  /// The label that has the most of a surface's readings; clutter if none has any.
  Label of(SurfaceId before) const;
  /// It has all but the share of outliers that the model expects.
  bool alone(SurfaceId before) const;
  /// By label, the surface whose id it goes on with: of those whose heir it is, the one of which it has the
  /// most readings, the older one on a tie; 0 if there is none. Those that nobody has seen yet come last.
  std::vector<SurfaceId> keepers(std::size_t labels, const std::set<SurfaceId>& unpublished) const;
  /// By label, the surface that had most of its readings; 0 if none had.
  std::vector<SurfaceId> origins(std::size_t labels) const;

 private:
  struct Shares {
    double all = 0;
    std::map<Label, double> with;
  };
  std::map<Label, double>::const_iterator most(const Shares& shares) const;

  std::map<SurfaceId, Shares> of_;
  std::map<Label, double> readings_;
};

}  // namespace octosurf::detection
