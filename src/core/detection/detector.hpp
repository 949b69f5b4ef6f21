#pragma once

#include "surfaces/ledger.hpp"
#include "surfaces/refusal.hpp"

#include <map>
#include <optional>
#include <span>
#include <vector>

namespace octosurf::detection {

using surfaces::Assignment;
using surfaces::Proposal;

/// Pending points to segment now, and the waiting rest.
struct Due {
  std::vector<PointId> points;  ///< key order
  surfaces::PendingQueue left;
  std::size_t waiting = 0;  ///< number of points of left.fresh in blocks of left.blocks
};

/// What Detector::segment() looks at: leftovers, or surfaces whose evidence has changed.
struct Part {
  std::vector<PointId> points{};      ///< pending, key order
  std::vector<SurfaceId> surfaces{};  ///< entire ones, ascending
  std::vector<PointId> gained{};      ///< by surfaces, which may be one with others there
};

/// The stages that decide about planes (paper, III-B and III-C; docs/design.md §4), called by
/// mapper::update_surfaces(). Each reads the map and returns what to change. Detectors are stateless: all
/// state is the map's, and is saved with it. Results do not depend on the number of threads.
class Detector {
 public:
  /// How a detector's planes are used.
  struct Traits {
    /// To their surfaces' readings; then new and changed surfaces expand in the same scan, too.
    bool refits = true;
    /// Outlines decide about inliers (paper, IV-A): they use inliers alone, without end points of readings
    /// and intersections of surfaces, and are made before points are added.
    bool outlines_decide = false;
  };
  const Traits traits;

  explicit Detector(const Traits& t) : traits(t) {}
  virtual ~Detector() = default;

  /// III-B1: points inside known surfaces. `fresh`: pending points in key order.
  virtual std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                              std::span<const PointId> fresh) const = 0;
  /// III-B2: points that surfaces gain beyond their boundaries. `fresh`: points in key order that came or
  /// joined a surface since the last expansion.
  virtual std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> fresh,
                                         int threads) const = 0;
  /// III-C1: those of the accumulated points, the map's queue and `fresh` in key order, that are enough in
  /// some place: those that have their `turn`, within the budget, or without one all.
  virtual Due due(const surfaces::MapView& map, const surfaces::PendingQueue& queue,
                  std::span<const PointId> fresh, std::optional<std::uint64_t> turn) const = 0;
  /// III-C2 to C4: planes of a part of the map; none if there is nothing to change.
  virtual std::optional<Proposal> segment(const surfaces::MapView& map, const Part& part,
                                          int threads) const = 0;

  /// The reasons why these pending points, in key order, have no surface; Reason::waiting for those that
  /// would get one.
  virtual std::map<PointId, surfaces::Refusal> refusals(const surfaces::MapView& map,
                                                        std::span<const PointId> pending) const = 0;
};

/// The detector named by the parameters; `paper`: the paper's. Throws Error(usage) if it is needed and null.
const Detector& detector_of(const Parameters& parameters, const Detector* paper);

}  // namespace octosurf::detection
