#pragma once

#include "detection/detector.hpp"
#include "detection/segment.hpp"

namespace octosurf::detection {

/// Detection by one likelihood and one criterion (docs/detection.md). Costs some 10 µs for each relabelled
/// point, independent of the map's size.
class LikelihoodDetector final : public Detector {
 public:
  /// `see_through`: rays through a plane speak against it; without, to measure what it is worth.
  explicit LikelihoodDetector(bool see_through = true) : Detector(Traits{}), see_through_(see_through) {}
  std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                      std::span<const PointId> fresh) const override;
  std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> fresh) const override;
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
  /// Pending points, and those within h of them. Surrounding surfaces take part as sums, and new planes are
  /// merged with them across gaps up to h (neighbourhood.hpp). No point leaves a surface.
  std::optional<Proposal> segment_leftovers(const surfaces::MapView& map,
                                            std::span<const PointId> points) const;
  /// Points of surfaces whose size has changed start without a label, of large ones only those where tiles
  /// disagree (tiles.hpp); those of the other `surfaces` start with theirs. The rest are sums, with contacts
  /// where another surface may be one with them; so are the surfaces of `gained`.
  std::optional<Proposal> revise(const surfaces::MapView& map, std::span<const SurfaceId> surfaces,
                                 std::span<const PointId> gained) const;

  bool see_through_;
};

}  // namespace octosurf::detection
