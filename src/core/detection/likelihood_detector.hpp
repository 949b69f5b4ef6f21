#pragma once

#include "detection/detector.hpp"
#include "detection/seed_patches.hpp"

namespace octosurf::detection {

/// Where it departs from the paper; each can be left out, to measure what it is worth.
struct Departures {
  bool takes_back = true;                     ///< what expanded may be segmented again
  bool guards = true;                         ///< of expansion (expand.hpp)
  bool see_through = true;                    ///< rays through a plane speak against it
  int ransac_iterations = seed_patch_trials;  ///< a plane; the paper: 200
};

/// Detection by one likelihood and one criterion (docs/detection.md). Costs some 10 µs for each relabelled
/// point, independent of the map's size.
class LikelihoodDetector final : public Detector {
 public:
  explicit LikelihoodDetector(const Departures& departures = {})
      : Detector(Traits{}), departures_(departures) {}
  std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                      std::span<const PointId> fresh) const override;
  std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> left) const override;
  Due due(const surfaces::MapView& map, const surfaces::PendingQueue& queue, std::span<const PointId> fresh,
          std::optional<std::uint64_t> turn) const override;
  /// Segmenting all is the batch form; tests compare the incremental one with it.
  std::optional<Proposal> segment(const surfaces::MapView& map, const Part& part) const override;
  std::map<PointId, surfaces::Refusal> refusals(const surfaces::MapView& map,
                                                std::span<const PointId> pending) const override;

 private:
  Departures departures_;
};

}  // namespace octosurf::detection
