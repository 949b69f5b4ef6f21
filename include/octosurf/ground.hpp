#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {
class GroundReadings;
class GroundTiles;
class StoreyGround;
struct ContactCells;
}  // namespace octosurf::planning

namespace octosurf {

/// What ground must be like, and for whom.
struct GroundRules {
  ContactShape foot = ContactShape::rectangle(0.22, 0.11);  ///< stands on it
  ContactLimits limits = Biped::limits();                   ///< of a contact
  std::optional<double>
      widest_unseen_m{};   ///< gap that a foot may span; empty: a quarter of its narrower side
  bool as_mapped = false;  ///< outlines of readings alone, which are not ground: voids stay closed

  /// The foot and limits of a robot on a map of resolution d. Edge and obstacle margins are d at least: an
  /// outline extends beyond the true edge by up to d (contact.hpp). The clearance is the height of its body;
  /// a planner, which knows where the body is, needs less over the feet.
  static GroundRules of(const Robot& robot, double resolution);
};

/// The ground of a snapshot, as planners may use it: without voids and wide unseen gaps, away from edges, and
/// clear of obstacles. (Outlines in a snapshot are as mapped, and are not ground.) Readable from any thread;
/// what belongs to a surface is computed when it is first read. Copies share it.
class GroundView {
 public:
  /// `octree`: of the same scan as `snapshot`. Throws Error(usage) for an empty one.
  GroundView(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const GroundRules& rules);
  /// By a biped's rules.
  GroundView(std::shared_ptr<const Snapshot> snapshot, const OccupancyView& octree)
      : GroundView(std::move(snapshot), octree, GroundRules::of(Biped{}, octree.resolution())) {}
  /// The same ground by other rules; shares what does not depend on them.
  GroundView by(const GroundRules& rules) const;
  /// The ground of a later snapshot of the same map, by these rules, equal to one made from nothing. It keeps
  /// what nothing changed near: the cost is that of finding the changes, some 2 ms a scan whatever the map's
  /// size, and of reading anew where there are some.
  GroundView next(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree) const;

  const GroundRules& rules() const { return rules_; }      ///< these
  const Snapshot& mapped() const { return *snapshot_; }    ///< outlines as mapped
  const OccupancyView& octree() const { return octree_; }  ///< as mapped
  double widest_unseen_m() const;                          ///< the rules', or what follows from the foot

  /// A surface without its voids and wide unseen gaps (gaps.hpp). Throws Error(data) if
  /// there is none of this id.
  SurfacePtr solid(SurfaceId id) const;
  /// Where a point contact may be: the solid surface less all margins and what is blocked; of a surface that
  /// slopes too much, less the edge margin alone. Without polygons if nothing is left.
  SurfacePtr supported(SurfaceId id) const;
  std::shared_ptr<const Snapshot> solid() const;      ///< all of them, everything else unchanged
  std::shared_ptr<const Snapshot> supported() const;  ///< likewise

  /// The gaps of a surface; the same error.
  const std::vector<Gap>& gaps(SurfaceId id) const;
  std::map<SurfaceId, std::vector<Gap>> gaps() const;  ///< of all that have some

  /// State of a place on a surface's plane, to d; the same error. Some 100 ns, and a tile's time for the
  /// first one in a square of 64 voxels.
  Ground ground_at(SurfaceId id, const Eigen::Vector3d& at) const;
  /// Shares of the rules' foot over each Ground, at points d/2 apart, 64 at most along its longer side.
  std::array<double, ground_names.size()> ground_under(SurfaceId id,
                                                       const Eigen::Isometry3d& T_map_contact) const;

  /// find_stairs() on solid(). The view before keeps them as long as no level surface's ground changes.
  const Stairs& stairs() const;

  /// contact_region() of the rules' foot on the solid surface.
  ContactRegion region(SurfaceId id, std::optional<double> yaw_rad) const;
  /// Of that what lies within `reach_m` of `about` along u and v, at a cost that does not depend on the
  /// surface's size: some ms for 2 m.
  ContactRegion region_about(SurfaceId id, const Eigen::Vector3d& about, double reach_m,
                             std::optional<double> yaw_rad) const;
  /// foothold() on the solid surface. Some 10 µs, and some ms for the first one in a square of 64 voxels.
  Foothold foothold(SurfaceId id, const Eigen::Vector3d& at, double yaw_rad) const;

 private:
  friend class planning::GroundReadings;
  friend class planning::StoreyGround;
  struct Solids;
  struct Outlines;
  struct Squares;
  struct Climb;
  std::shared_ptr<const planning::GroundTiles> tiles_of(SurfaceId id) const;
  /// ground_at() within the surface's outline and its holes.
  std::optional<Ground> ground_within(SurfaceId id, const Eigen::Vector3d& at) const;
  Surface part_of(SurfaceId id, const Eigen::AlignedBox2d& box) const;
  Eigen::AlignedBox2d square_of(int x, int y) const;
  std::vector<const planning::ContactCells*> cells_in(SurfaceId id, const Eigen::AlignedBox2d& box) const;

  std::shared_ptr<const Snapshot> snapshot_;
  OccupancyView octree_;
  GroundRules rules_;
  std::shared_ptr<Solids> solids_;
  std::shared_ptr<Outlines> supported_;
  std::shared_ptr<Squares> squares_;
  std::shared_ptr<Climb> climb_;
};

}  // namespace octosurf
