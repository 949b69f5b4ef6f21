#pragma once

#include "surfaces/refusal.hpp"

#include <string>
#include <vector>

namespace octosurf {

/// The reason's sentence with its numbers and ids filled in.
std::string sentence_of(const Refusal& refusal);
/// The number behind it, if there is one.
std::vector<Figure> figures_of(const Refusal& refusal);

}  // namespace octosurf
