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
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace CLI {
class App;
class Option_group;
}  // namespace CLI

namespace octosurf {

/// Options of `query` for footholds and contact regions.
struct ContactQuery {
  std::vector<double> foothold;      ///< x y z, m, and the heading, degrees
  std::optional<SurfaceId> regions;  ///< of this surface
  std::string foot;                  ///< "LxW" of a sole, or the radius of a disc, m
  std::optional<double> yaw_deg;
  double edge_margin = 0, frontier_margin = 0, obstacle_margin = 0, clearance = 0, gap_depth = 0;  ///< m
  double unseen_share = 0.25;  ///< of the foot's narrower side: the widest unseen gap that it may span
  std::size_t pieces = 0;      ///< at most so many of a region

  bool asked() const { return !foothold.empty() || regions.has_value(); }
};

/// LENGTHxWIDTH of a sole or the radius of a disc, m, as --foot takes it. Throws Error(usage) for anything
/// else.
ContactShape foot_of(const std::string& text);

void add_contact_options(CLI::App& verb, CLI::Option_group& question, ContactQuery& query);

/// The map for contact queries.
struct AskedMap {
  std::string name;  ///< for errors
  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
  Eigen::Vector3d up;
  std::function<std::vector<PolygonEdges>(const Surface&)> edges_of;  ///< label_edges()
};

struct FoundRegion {
  SurfacePtr surface;  ///< as find_gaps() tells
  ContactRegion region;
  std::vector<ConvexPiece> pieces;
};

/// For `query.regions`. Throws Error(data) if there is no such surface, Error(usage) for invalid limits.
FoundRegion find_region(const AskedMap& map, const ContactQuery& query, double max_slope_rad);
struct FoundFoothold {
  Foothold foothold;
  /// Shares of the foot's area over each Ground, [0, 1].
  std::array<double, ground_names.size()> ground{};
};

/// For `query.foothold`, likewise.
FoundFoothold find_foothold(const AskedMap& map, const ContactQuery& query, double max_slope_rad);

/// Prints the answer.
void answer(const AskedMap& map, const ContactQuery& query, double max_slope_rad, bool json);

}  // namespace octosurf
