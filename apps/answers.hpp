#pragma once

#include "planning/questions.hpp"

#include <string>

#include <octosurf/ground_patch.hpp>

// Answers as one line of JSON, as printed by `octosurf query --json` and returned by `octosurf serve`. Map
// frame, m and degrees.

namespace octosurf {

std::string place_json(const planning::AskedMap& map, const planning::PlaceQuestion& question,
                       const planning::PlaceAnswer& found);
std::string foothold_json(const planning::FoundFoothold& found);
std::string region_json(const planning::FoundRegion& found);
std::string patch_json(const PatchLayout& layout, const GroundPatch& patch);

const char* state_name(OccupancyView::State state);

/// Throws Error(data) if there is no such place as was asked for; a ray may meet nothing.
void require_found(const planning::AskedMap& map, const planning::PlaceQuestion& question,
                   const planning::PlaceAnswer& found);

}  // namespace octosurf
