#pragma once

#include "surfaces/refusal.hpp"

#include <string>
#include <vector>

namespace octosurf::diagnosis {

/// The reason's sentence with its numbers and ids filled in.
std::string sentence_of(const surfaces::Refusal& refusal);
/// The number behind it, if any.
std::vector<Figure> figures_of(const surfaces::Refusal& refusal);

}  // namespace octosurf::diagnosis
