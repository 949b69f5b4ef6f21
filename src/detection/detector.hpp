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

/// A pending point, and the surface that takes it.
struct Assignment {
  surfaces::MapView::Index point = 0;
  SurfaceId surface = 0;
};

/// Pending points whose turn it is, and what waits on.
struct Due {
  std::vector<geometry::VoxelKey> points;    ///< worth segmenting now, key order
  std::vector<geometry::VoxelKey> unplanar;  ///< in whose blocks no plane begins, key order
  surfaces::PendingQueue left;
  std::size_t waiting = 0;  ///< points of left.fresh in blocks of left.blocks
};

/// Planes of a part of the map, for write_surfaces().
struct Found {
  Readings readings;
  Segmentation planes;
  std::vector<geometry::VoxelKey> beside{};  ///< surfaces expand once more from what is pending beside these
  std::vector<geometry::VoxelKey> still_new{};  ///< what of it stays pending counts as new with the next scan
  bool fitted_once = false;                     ///< later scans' readings do not move the planes
};

/// The steps of a scan's way that decide about planes (paper, III-B and III-C; docs/design.md §4). The mapper
/// calls add_inliers(), expand(), due(), detect(), expand(), revise(), expand() and fit() in this order. Each
/// looks at the map and proposes. Detectors have no state of their own: what decides about the next scan is
/// the map's, and is saved with it.
class Detector {
 public:
  virtual ~Detector() = default;

  /// III-B1: points inside known surfaces. `fresh`: pending points in key order.
  virtual std::vector<Assignment> add_inliers(const surfaces::MapView& map,
                                              std::span<const geometry::VoxelKey> fresh) const = 0;
  /// III-B2: what surfaces gain beyond their boundaries. `left`: pending points in key order.
  virtual std::vector<Assignment> expand(const surfaces::MapView& map,
                                         std::span<const geometry::VoxelKey> left) const = 0;
  /// III-C1: of `before`, which wait already, and `fresh`, in key order, those to be segmented now: `all`, or
  /// those for which there is a budget. `expanded` is what surfaces are to gain, and does not wait; what
  /// should be segmented all the same is taken out of it.
  virtual Due due(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                  surfaces::PendingQueue before, std::span<const geometry::VoxelKey> fresh, bool all,
                  std::vector<Assignment>& expanded) const = 0;
  /// III-C: planes of what is due. `expanded` has been assigned.
  virtual std::optional<Found> detect(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                                      std::span<const geometry::VoxelKey> due,
                                      std::span<const Assignment> expanded) const = 0;
  /// Planes of surfaces that are looked at again, because their size has changed (SurfaceModel).
  virtual std::optional<Found> revise(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                                      const std::set<SurfaceId>& changed) const = 0;
  /// The planes that these surfaces should have now.
  virtual std::vector<std::pair<SurfaceId, Plane>> fit(const surfaces::MapView& map,
                                                       const std::set<SurfaceId>& surfaces) const = 0;
  /// Outlines are those of the inliers, without where readings end and surfaces meet. Such outlines decide,
  /// so they are brought up to date before points are added.
  virtual bool outlines_inliers_alone() const = 0;
  /// Planes of all points, owned and pending alike.
  virtual Found detect_anew(const surfaces::MapView& map, const occupancy::OccupancyMap& octree) const = 0;

  /// Why these pending points, in key order, are no surface; Reason::waiting for those that would be one.
  virtual std::map<geometry::VoxelKey, surfaces::Refusal> refusals(
      const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
      std::span<const geometry::VoxelKey> pending) const = 0;
};

/// The one that the parameters name. Throws Error(usage) if the program does not link it.
const Detector& detector_of(const Parameters& parameters);
/// Makes `detector`, which must stay, the paper's. From any thread.
void set_paper_detector(const Detector& detector);

void assign(surfaces::Ledger& ledger, std::span<const Assignment> assignments);

/// The pending points that have a plane.
std::vector<geometry::VoxelKey> newly_explained(const Found& found);

/// Pending points beside these, in key order.
std::vector<geometry::VoxelKey> pending_beside(const surfaces::MapView& map,
                                               std::span<const geometry::VoxelKey> keys);

}  // namespace octosurf::detection
