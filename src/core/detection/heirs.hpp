#pragma once

#include "detection/segmentation.hpp"

#include <cstddef>
#include <map>
#include <set>
#include <vector>

namespace octosurf::detection {

/// Maps surfaces to the labels that continue them.
class Heirs {
 public:
  Heirs(const Readings& readings, const Segmentation& segmentation);

  /// Surfaces with a reading or a part outside.
  std::vector<SurfaceId> surfaces() const;
  /// The label with most of a surface's readings; clutter if none has any.
  Label of(SurfaceId before) const;
  /// Whether the label has all but the model's share of outliers.
  bool keeps_most_readings(SurfaceId before) const;
  /// By label, the surface whose id it keeps: of the surfaces it continues, the one with most readings in it,
  /// the older one on a tie; 0: none. Unpublished surfaces come last.
  std::vector<SurfaceId> keepers(std::size_t labels, const std::set<SurfaceId>& unpublished) const;
  /// By label, the surface that had most of its readings; 0: none.
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
