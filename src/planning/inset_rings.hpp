#pragma once

#include "planning/inset_lines.hpp"

#include <optional>
#include <span>
#include <vector>

namespace octosurf::planning {

/// The polygons bounded by rests, which are joined where the same two lines meet; in the order of their
/// lines. Chains outside the polygon are spurious and dropped, closed or not. Empty if any other is not
/// closed.
std::optional<std::vector<Polygon>> bounded_by(const InsetLines& lines, std::span<const Rest> rests);

}  // namespace octosurf::planning
