#pragma once

#include "surfaces/ledger.hpp"
#include "surfaces/refusal.hpp"

#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

namespace octosurf::detection {

using surfaces::Assignment;
using surfaces::Proposal;

/// The outcome of Detector::detect().
struct Detection {
  std::optional<Proposal> found;
  std::vector<PointId> segmented;  ///< points that were pending, key order
  surfaces::PendingQueue left;
  std::size_t waiting = 0;  ///< number of points of left.fresh in blocks of left.blocks
};

/// The stages that decide about planes (paper, III-B and III-C; docs/design.md §4), called by
/// mapper::update_surfaces(). Each reads the map and returns a proposal. Detectors are stateless: all state
/// is the map's, and is saved with it.
class Detector {
 public:
  virtual ~Detector() = default;

  /// III-B1: points inside known surfaces. `fresh`: pending points in key order.
  virtual std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                              std::span<const PointId> fresh) const = 0;
  /// III-B2: points that surfaces gain beyond their boundaries. `left`: pending points in key order.
  virtual std::vector<Assignment> expand(const surfaces::MapView& map,
                                         std::span<const PointId> left) const = 0;
  /// III-C: planes of accumulated points. Selects those to segment now from the map's queue and `fresh`, in
  /// key order: those that have their `turn`, within the budget, or without one all. `expanded` has
  /// been assigned; some of it may be segmented again.
  virtual Detection detect(const surfaces::MapView& map, const surfaces::PendingQueue& queue,
                           std::span<const PointId> fresh, std::optional<std::uint64_t> turn,
                           std::span<const Assignment> expanded) const = 0;
  /// Planes of surfaces that are segmented again, because their size has changed (SurfaceModel).
  virtual std::optional<Proposal> revise(const surfaces::MapView& map,
                                         const std::set<SurfaceId>& changed) const = 0;
  /// As in the paper: planes are not refitted, surfaces expand with the next scan only, and outlines use the
  /// inliers alone, without end points of readings and intersections of surfaces. Outlines then affect
  /// decisions, so they are updated before points are added.
  virtual bool as_in_paper() const = 0;
  /// Planes of all points, owned and pending alike.
  virtual Proposal detect_anew(const surfaces::MapView& map) const = 0;

  /// The reasons why these pending points, in key order, have no surface; Reason::waiting for those that
  /// would get one.
  virtual std::map<PointId, surfaces::Refusal> refusals(const surfaces::MapView& map,
                                                        std::span<const PointId> pending) const = 0;
};

/// The detector named by the parameters; `paper`: the paper's. Throws Error(usage) if it is needed and null.
const Detector& detector_of(const Parameters& parameters, const Detector* paper);

}  // namespace octosurf::detection
