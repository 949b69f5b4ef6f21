#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/pieces.hpp>
#include <octosurf/queries.hpp>

// Questions of the command line about a map, and their answers. Map frame, m and rad. All throw Error(usage)
// for a question that makes no sense, Error(data) where the map has no answer.

namespace octosurf::planning {

/// A map at one moment, for queries from any thread.
struct AskedMap {
  /// `of`: its name, for errors. `view`: of the same scan as the snapshot.
  AskedMap(std::string of, std::shared_ptr<const Snapshot> now, OccupancyView view,
           const Eigen::Vector3d& upward);

  std::string name;
  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
  Eigen::Vector3d up;
  SurfaceIndex index;

  /// Ground by these rules. Gaps narrower than a disc of two voxels are never bridged (gaps.hpp).
  GroundView ground(GroundRules rules) const;
  /// Outlines without voids; no unseen gaps are bridged.
  GroundView bare_ground() const;
  /// Throws Error(data) if there is none of this id.
  const Surface& surface(SurfaceId id) const;
};

/// Of footholds and contact regions; by default the robot's.
struct ContactQuestion {
  Robot robot = Biped{};
  std::optional<ContactShape> foot;
  std::optional<double> yaw_rad, max_slope_rad;  ///< no heading: any
  std::optional<double> edge_margin_m, obstacle_margin_m, clearance_m;
  double unseen_share = 0.25;         ///< of the foot's narrower side: the widest unseen gap that it may span
  bool as_mapped = false;             ///< outlines of readings, without margins or clearance
  bool unknown_is_free = false;       ///< space over the foot may be unknown
  SurfaceId surface = 0;              ///< of the region
  std::optional<Eigen::Vector3d> at;  ///< of the foothold; about which the region is read
  double reach_m = 1;                 ///< along u and v, of a region about a place
  std::size_t pieces = 0;             ///< of the region, at most
};

struct FoundRegion {
  SurfacePtr surface;  ///< whose frame it has
  ContactRegion region;
  std::vector<ConvexPiece> pieces;
};

struct FoundFoothold {
  Foothold foothold;
  double off_m = 0;                                  ///< along up: the asked place above the surface's
  std::array<double, ground_names.size()> ground{};  ///< shares of the foot's area over each, [0, 1]
};

/// LENGTHxWIDTH of a sole or the radius of a disc, m.
ContactShape foot_of(const std::string& text);
GroundRules rules_of(const ContactQuestion& question, const Eigen::Vector3d& up, double resolution);
FoundRegion find_region(const AskedMap& map, const ContactQuestion& question);
/// On what a foot lowered there meets, rather than a riser in front of it. Throws Error(data), too, if none
/// is within half of the robot's step.
FoundFoothold find_foothold(const AskedMap& map, const ContactQuestion& question);

}  // namespace octosurf::planning
