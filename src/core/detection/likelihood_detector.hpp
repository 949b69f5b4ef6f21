#pragma once

#include "detection/expand.hpp"
#include "detection/segment.hpp"
#include "detection/waiting.hpp"

namespace octosurf::detection {

/// Detection by one likelihood and one criterion (docs/detection.md). Costs some 10 µs for each relabelled
/// point, independent of the map's size.
class LikelihoodDetector final : public Detector {
 public:
  /// `see_through`: rays through a plane speak against it; without, to measure what it is worth.
  explicit LikelihoodDetector(bool see_through = true) : Detector(Traits{}), see_through_(see_through) {}
  std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                      std::span<const PointId> fresh) const override {
    return detection::add_inliers(map, fresh);
  }
  std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> fresh,
                                 int threads) const override;
  Due due(const surfaces::MapView& map, const surfaces::PendingQueue& queue, std::span<const PointId> fresh,
          std::optional<std::uint64_t> turn) const override {
    return due_to_segment(map, queue, fresh, turn);
  }
  /// Segmenting all is the batch form; tests compare the incremental one with it. Pending points are
  /// segmented with those within h of them; surfaces beside these take part as sums. New planes are merged
  /// with them, and with each other across gaps up to h; no point leaves a surface else.
  /// Surfaces are segmented with contacts where another one may be one with them, and so are the surfaces of
  /// `gained`. Each in parts (parts.hpp).
  std::optional<Proposal> segment(const surfaces::MapView& map, const Part& part, int threads) const override;
  std::map<PointId, surfaces::Refusal> refusals(const surfaces::MapView& map,
                                                std::span<const PointId> pending) const override;

 private:
  Segmentation segmented(const surfaces::MapView& map, const Readings& readings, Segmentation known,
                         std::vector<Refused>* refused = nullptr) const;

  bool see_through_;
};

}  // namespace octosurf::detection
