#pragma once

#include <string>
#include <vector>

#include <octosurf/stairs.hpp>

namespace octosurf::io {

/// JSON text of a stair, of several, and of single steps, as in exported files and answers: m, degrees, map
/// frame.
std::string stair_json(const Stair& stair);
std::string stairs_json(const std::vector<Stair>& stairs);
std::string steps_json(const std::vector<Step>& steps);  ///< likewise

}  // namespace octosurf::io
