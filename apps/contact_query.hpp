#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace CLI {
class App;
class Option_group;
}  // namespace CLI

namespace octosurf {

/// Options of `query` for footholds and contact regions. What is not given is the robot's.
struct ContactQuery {
  std::vector<double> foothold;       ///< x y z, m, and the heading, degrees
  std::optional<SurfaceId> regions;   ///< of this surface
  std::string robot = "biped", foot;  ///< as `plan` takes them
  std::optional<double> yaw_deg, max_slope_deg;
  std::optional<double> edge_margin, frontier_margin, obstacle_margin, clearance;  ///< m
  double unseen_share = 0.25;  ///< of the foot's narrower side: the widest unseen gap that it may span
  bool as_mapped = false;      ///< outlines of readings, without margins or clearance
  std::size_t pieces = 0;      ///< at most so many of a region

  bool asked() const { return !foothold.empty() || regions.has_value(); }
};

/// LENGTHxWIDTH of a sole or the radius of a disc, m, as --foot takes it. Throws Error(usage) for anything
/// else.
ContactShape foot_of(const std::string& text);

void add_contact_options(CLI::App& verb, CLI::Option_group& question, ContactQuery& query);

/// The map for contact queries.
struct AskedMap {
  AskedMap(std::string of, std::shared_ptr<const Snapshot> map, OccupancyView view,
           const Eigen::Vector3d& upward, std::function<std::vector<PolygonEdges>(const Surface&)> label);

  std::string name;  ///< for errors
  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
  Eigen::Vector3d up;
  std::function<std::vector<PolygonEdges>(const Surface&)> edges_of;  ///< label_edges()
  GroundView ground;                                                  ///< by a biped's rules
};

struct FoundRegion {
  SurfacePtr surface;  ///< solid, see GroundView
  ContactRegion region;
  std::vector<ConvexPiece> pieces;
};

/// The rules of a query: its robot's, with what it gives beside. Throws Error(usage) for an invalid foot or
/// robot.
GroundRules rules_of(const ContactQuery& query, const Eigen::Vector3d& up, double resolution);

/// For `query.regions`. Throws Error(data) if there is no such surface, Error(usage) for invalid limits.
FoundRegion find_region(const AskedMap& map, const ContactQuery& query);
struct FoundFoothold {
  Foothold foothold;
  /// Shares of the foot's area over each Ground, [0, 1].
  std::array<double, ground_names.size()> ground{};
};

/// For `query.foothold`, likewise.
FoundFoothold find_foothold(const AskedMap& map, const ContactQuery& query);

/// Prints the answer.
void answer(const AskedMap& map, const ContactQuery& query, bool json);

}  // namespace octosurf
