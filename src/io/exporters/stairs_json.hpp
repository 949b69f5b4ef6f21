#pragma once

#include <nlohmann/json_fwd.hpp>

#include <octosurf/stairs.hpp>

namespace octosurf {

// Steps and stairs as in exported files and answers: m, degrees, map frame.
void to_json(nlohmann::ordered_json& json, const Step& step);
void to_json(nlohmann::ordered_json& json, const Stair& stair);

}  // namespace octosurf
