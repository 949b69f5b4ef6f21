#pragma once

#include "detection/detector.hpp"
#include "detection/seed_patches.hpp"
#include "detection/segment.hpp"

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
  SegmentLimits limits_in_cells(const surfaces::MapView& map) const;
  Proposal segmented(const surfaces::MapView& map, const Readings& readings, Segmentation known) const;
  Proposal segment_all(const surfaces::MapView& map) const;
  /// Pending points and those of `expanded` that another surface also explains, or that lie in a block of
  /// seed patches with a seed patch of points due: it may extend into them. Surrounding surfaces take part as
  /// sums, and are merged across gaps up to h (neighbourhood.hpp).
  std::optional<Proposal> segment_points(const surfaces::MapView& map, std::span<const PointId> points,
                                         std::span<const Assignment> expanded) const;
  /// The surfaces' points start without a label; of large surfaces, only those where tiles disagree
  /// (tiles.hpp). The rest are sums, with contacts where another surface may be one with them.
  std::optional<Proposal> segment_surfaces(const surfaces::MapView& map,
                                           std::span<const SurfaceId> surfaces) const;

  Departures departures_;
};

}  // namespace octosurf::detection
