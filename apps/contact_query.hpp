#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/map.hpp>

namespace CLI {
class App;
class Option_group;
}  // namespace CLI

namespace octosurf {

/// What `query` takes for footholds and contact regions.
struct ContactQuery {
  std::vector<double> foothold;      ///< x y z, m, and the heading, degrees
  std::optional<SurfaceId> regions;  ///< of this surface
  std::string foot;                  ///< "LxW" of a sole, or the radius of a disc, m
  std::optional<double> yaw_deg;
  double edge_margin = 0, frontier_margin = 0, obstacle_margin = 0, clearance = 0, gap_depth = 0;  ///< m
  std::size_t pieces = 0;  ///< at most so many of a region

  bool asked() const { return !foothold.empty() || regions.has_value(); }
};

/// LENGTHxWIDTH of a sole or the radius of a disc, m, as --foot takes it. Throws Error(usage) for anything
/// else.
ContactShape foot_of(const std::string& text);

void add_contact_options(CLI::App& verb, CLI::Option_group& question, ContactQuery& query);

/// Answers on stdout. `map_name` is for errors.
void answer(const Map& map, const std::string& map_name, const ContactQuery& query, const Eigen::Vector3d& up,
            double max_slope_rad, bool json);

}  // namespace octosurf
