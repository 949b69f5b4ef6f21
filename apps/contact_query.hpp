#pragma once

#include "planning/questions.hpp"

namespace CLI {
class App;
class Option_group;
}  // namespace CLI

namespace octosurf {

/// Options of `query` for footholds and contact regions.
struct ContactQuery : planning::ContactQuestion {
  std::vector<double> foothold, about;  ///< x y z, m, and of a foothold the heading, degrees
  std::optional<SurfaceId> regions;     ///< of this surface
  std::string foot_text;
  std::optional<double> yaw_deg;

  bool asked() const { return !foothold.empty() || regions.has_value(); }
};

void add_contact_options(CLI::App& verb, CLI::Option_group& question, ContactQuery& query);

/// Prints the answer.
void answer(const planning::AskedMap& map, ContactQuery query, bool json);

}  // namespace octosurf
