#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// What polygons of one surface have that Polygon's contract rules out; nothing if they keep it: vertices
/// finite, rings simple, outer ones counter-clockwise, holes clockwise and inside their own outer ring, no
/// two polygons over one another. Rings may share single vertices. Exact; cost O(n log n) in vertices,
/// whatever they are.
std::optional<std::string_view> fault_of(std::span<const Polygon> polygons);

/// The same, as an Error(data) that names `where`.
void require_polygons(std::span<const Polygon> polygons, const std::string& where);

}  // namespace octosurf::geometry
