#pragma once

#include "detection/segmentation.hpp"
#include "surfaces/ledger.hpp"
#include "surfaces/refusal.hpp"

#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace octosurf::detection {

/// Assigns a pending point to a surface.
struct Assignment {
  surfaces::MapView::Index point = 0;
  SurfaceId surface = 0;
};

/// Pending points to segment now, and the waiting rest.
struct Due {
  std::vector<geometry::VoxelKey> points;    ///< worth segmenting now, key order
  std::vector<geometry::VoxelKey> unplanar;  ///< in blocks without a plane, key order
  surfaces::PendingQueue left;
  std::size_t waiting = 0;  ///< number of points of left.fresh in blocks of left.blocks
};

/// Planes found in a part of the map, input of write_surfaces().
struct FoundPlanes {
  Readings readings;
  Segmentation planes;
  std::vector<geometry::VoxelKey> beside{};  ///< surfaces expand once more into pending points beside these
  std::vector<geometry::VoxelKey> still_new{};  ///< if still pending, new in the next scan
  bool fitted_once = false;                     ///< later scans' readings do not change the planes
};

/// The stages that decide about planes (paper, III-B and III-C; docs/design.md §4). The mapper calls
/// add_inliers(), expand(), due(), detect(), expand(), revise(), expand() and fit() in this order. Each reads
/// the map and returns a proposal. Detectors are stateless: all state is the map's, and is saved with it.
class Detector {
 public:
  virtual ~Detector() = default;

  /// III-B1: points inside known surfaces. `fresh`: pending points in key order.
  virtual std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                              std::span<const geometry::VoxelKey> fresh) const = 0;
  /// III-B2: points that surfaces gain beyond their boundaries. `left`: pending points in key order.
  virtual std::vector<Assignment> expand(const surfaces::MapView& map,
                                         std::span<const geometry::VoxelKey> left) const = 0;
  /// III-C1: selects the points to segment now from `before`, the waiting ones, and `fresh`, in key order:
  /// `all`, or those within the budget. `expanded`, the points to be assigned by expansion, do not wait;
  /// those that should be segmented nevertheless are removed from it.
  virtual Due due(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                  surfaces::PendingQueue before, std::span<const geometry::VoxelKey> fresh, bool all,
                  std::vector<Assignment>& expanded) const = 0;
  /// III-C: planes of the points due. `expanded` has been assigned.
  virtual std::optional<FoundPlanes> detect(const surfaces::MapView& map,
                                            const occupancy::OccupancyMap& octree,
                                            std::span<const geometry::VoxelKey> due,
                                            std::span<const Assignment> expanded) const = 0;
  /// Planes of surfaces that are segmented again, because their size has changed (SurfaceModel).
  virtual std::optional<FoundPlanes> revise(const surfaces::MapView& map,
                                            const occupancy::OccupancyMap& octree,
                                            const std::set<SurfaceId>& changed) const = 0;
  /// The updated planes of these surfaces.
  virtual std::vector<std::pair<SurfaceId, Plane>> fit(const surfaces::MapView& map,
                                                       const std::set<SurfaceId>& surfaces) const = 0;
  /// Whether outlines use the inliers alone, without end points of readings and intersections of surfaces.
  /// They then affect decisions, so they are updated before points are added.
  virtual bool outlines_inliers_alone() const = 0;
  /// Planes of all points, owned and pending alike.
  virtual FoundPlanes detect_anew(const surfaces::MapView& map,
                                  const occupancy::OccupancyMap& octree) const = 0;

  /// The reasons why these pending points, in key order, have no surface; Reason::waiting for those that
  /// would get one.
  virtual std::map<geometry::VoxelKey, surfaces::Refusal> refusals(
      const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
      std::span<const geometry::VoxelKey> pending) const = 0;
};

/// The detector named by the parameters. Throws Error(usage) if the program does not link it.
const Detector& detector_of(const Parameters& parameters);
/// Registers `detector`, which must outlive all uses, as the paper's. From any thread.
void set_paper_detector(const Detector& detector);

void assign(surfaces::Ledger& ledger, std::span<const Assignment> assignments);

/// The pending points that were assigned a plane.
std::vector<geometry::VoxelKey> newly_explained(const FoundPlanes& found);

/// Pending points beside these, in key order.
std::vector<geometry::VoxelKey> pending_beside(const surfaces::MapView& map,
                                               std::span<const geometry::VoxelKey> keys);

}  // namespace octosurf::detection
