#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/occupancy.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// A map shown on a page.
struct PageMap {
  std::string name;                                        ///< label; errors name it, too
  std::shared_ptr<const Snapshot> snapshot;                ///< its surfaces and cylinders
  OccupancyView octree{};                                  ///< Map::octree(); if empty, no voxels are shown
  std::vector<Stair> stairs{};                             ///< of find_stairs(), drawn with their measures
};

/// Options of make_page().
struct PageOptions {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame
  double max_mb = 10;                             ///< 10⁶ bytes, limit of the size
};

/// A page in HTML (UTF-8) to look at the map, pick and measure, in any browser of 2023 or later with WebGL 2.
///
/// 1. The page is self-contained. It fetches nothing, and its content security policy forbids it.
/// 2. Surfaces are in it as export_surfaces() writes them as .json, without `boundary`.
/// 3. It is not larger than `max_mb`: if need be, voxels are merged to 2 d, 4 d … 32 d, each as the one of
/// its
///    voxels with the highest log-odds, then left out, and the page says so.
/// 4. Same map, same bytes.
/// Throws Error(usage) if a limit makes no sense, and where the library was built without the page (Node.js);
/// Error(data) for numbers that are not finite; Error(output) if the surfaces alone are larger than `max_mb`.
std::string make_page(const PageMap& map, const PageOptions& options = {});

}  // namespace octosurf
