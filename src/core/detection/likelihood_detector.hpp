#pragma once

#include "detection/detector.hpp"

namespace octosurf::detection {

/// Detection by one likelihood and one criterion (docs/detection.md). Costs some 10 µs for each relabelled
/// point, independent of the map's size.
class LikelihoodDetector final : public Detector {
 public:
  /// expand.hpp.
  std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                      std::span<const PointId> fresh) const override;
  std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> left) const override;
  /// Segments the points due (waiting.hpp) and those of `expanded` that another surface also explains, or
  /// that lie in a block of seed patches with a seed patch of points due: it may extend into them.
  /// Surrounding surfaces take part as sums, and are merged across gaps up to h (neighbourhood.hpp).
  Detection detect(const surfaces::MapView& map, const surfaces::PendingQueue& queue,
                   std::span<const PointId> fresh, std::optional<std::uint64_t> turn,
                   std::span<const Assignment> expanded) const override;
  /// The surfaces' points start without a label; of large surfaces, only those where tiles disagree
  /// (tiles.hpp). The rest are sums, with contacts where another surface may be one with them.
  std::optional<Proposal> revise(const surfaces::MapView& map,
                                 const std::set<SurfaceId>& changed) const override;
  bool as_in_paper() const override { return false; }
  /// The batch form; tests compare the incremental one with it.
  Proposal detect_anew(const surfaces::MapView& map) const override;
  std::map<PointId, surfaces::Refusal> refusals(const surfaces::MapView& map,
                                                std::span<const PointId> pending) const override;
};

}  // namespace octosurf::detection
