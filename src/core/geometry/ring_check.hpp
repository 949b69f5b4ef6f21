#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// The first violation of Polygon's contract by polygons of one surface; empty if valid: vertices finite,
/// rings simple, outer ones counter-clockwise, holes clockwise and inside their own outer ring, polygons
/// disjoint. Rings may share single vertices. Exact; cost O(n log n) in vertices for any input.
std::optional<std::string_view> fault_of(std::span<const Polygon> polygons);

/// Throws an Error(data) naming `where` for a violation.
void require_polygons(std::span<const Polygon> polygons, const std::string& where);

}  // namespace octosurf::geometry
