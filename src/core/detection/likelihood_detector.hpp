#pragma once

#include "detection/detector.hpp"

namespace octosurf::detection {

/// Detection by one likelihood and one criterion (docs/detection.md). Costs some 10 µs for each relabelled
/// point, independent of the map's size.
class LikelihoodDetector final : public Detector {
 public:
  LikelihoodDetector() : Detector(Traits{}) {}
  std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                      std::span<const PointId> fresh) const override;
  std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> left) const override;
  Due due(const surfaces::MapView& map, const surfaces::PendingQueue& queue, std::span<const PointId> fresh,
          std::optional<std::uint64_t> turn) const override;
  /// Segmenting all is the batch form; tests compare the incremental one with it.
  std::optional<Proposal> segment(const surfaces::MapView& map, const Part& part) const override;
  std::map<PointId, surfaces::Refusal> refusals(const surfaces::MapView& map,
                                                std::span<const PointId> pending) const override;
};

}  // namespace octosurf::detection
