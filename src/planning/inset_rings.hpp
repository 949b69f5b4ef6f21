#pragma once

#include "planning/inset_lines.hpp"

#include <optional>
#include <span>
#include <vector>

namespace octosurf::planning {

/// The polygons that rests bound, which go on where the same two lines meet; in the order of their lines.
/// What lies off the polygon is bounded by nothing that was asked for and is dropped, closed or not. Nothing
/// if any other is not closed.
std::optional<std::vector<Polygon>> bounded_by(const InsetLines& lines, std::span<const Rest> rests);

}  // namespace octosurf::planning
