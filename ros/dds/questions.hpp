#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/queries.hpp>

// Requests and responses of the services of octosurf_msgs, apart from how they are serialised; the fields are
// those of the .srv files.

namespace octosurf::services {

/// A map at one moment, its octree with it.
struct AskedMap {
  explicit AskedMap(std::shared_ptr<const Snapshot> of, const AskedMap* previous = nullptr,
                    const Eigen::Vector3d& up_direction = Eigen::Vector3d::UnitZ())
      : snapshot(std::move(of)),
        index(snapshot, previous != nullptr ? &previous->index : nullptr),
        up(up_direction) {}

  const std::shared_ptr<const Snapshot> snapshot;
  const SurfaceIndex index;
  const Eigen::Vector3d up;
};

struct PlaceQuestion {
  enum Kind : std::uint8_t { nearest, below, ray, sphere, box, voxel, ground };
  std::uint8_t kind = nearest;
  Eigen::Vector3d point, corner, direction;
  double distance = 0, max_slope = 0;
  SurfaceId surface = 0;
};
struct PlaceAnswer {
  enum State : std::uint8_t { unknown, free, occupied };
  bool found = false;
  std::vector<SurfaceId> surfaces;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double distance = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  bool front = false;
  std::uint8_t state = unknown;
  double log_odds = 0;
  std::string_view ground;
};

struct RegionsQuestion {
  SurfaceId surface = 0;
  double length = 0, width = 0, radius = 0;
  bool any_heading = false;
  double yaw = 0, max_slope = 0, edge_margin = 0, obstacle_margin = 0, clearance = 0;
  std::uint32_t pieces = 0;
};
struct FoundRegion {
  const Surface* surface;  ///< of the snapshot
  ContactRegion region;
  std::vector<ConvexPiece> pieces;
};

struct PlanQuestion {
  std::string robot;
  Standing start, goal;
  std::uint32_t expansions = 0;
  double time_limit = 0;
};

// All throw Error for a question that makes no sense.
PlaceAnswer answer(const AskedMap& map, const PlaceQuestion& question);
std::vector<FoundRegion> answer(const AskedMap& map, const RegionsQuestion& question);
FootstepPlan answer(const AskedMap& map, const PlanQuestion& question);

/// "maps/office: 12 surfaces of revision 34 saved".
std::string kept_line(const std::string& stem, const Snapshot& snapshot, const std::string& what);

}  // namespace octosurf::services
