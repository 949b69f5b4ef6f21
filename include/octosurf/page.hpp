#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/changes.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// Where a foot may stand on a map's surfaces, for a page to show.
struct PageFoot {
  std::string name;                    ///< for its readers: which foot, in which heading, with which margins
  std::vector<ContactRegion> regions;  ///< one of each surface that was asked, of the page's snapshot
};

/// A footstep plan for a page to show.
struct PagePlan {
  std::string name;  ///< for its readers
  std::string json;  ///< as plan_files.hpp's to_json() writes it
};

/// A map as a page shows it.
struct PageMap {
  std::string name;                          ///< for its readers
  std::shared_ptr<const Snapshot> snapshot;  ///< its surfaces and cylinders
  OccupancyView octree{};  ///< Map::octree(); of one that knows nothing, no voxels are shown
  /// label_edges() of the snapshot's surfaces; where there are any, edges are drawn by their kind.
  std::map<SurfaceId, std::vector<PolygonEdges>> edges{};
  /// What became of the map before this one in the list: changes_since() its revision if this map goes on
  /// from it, else compare_maps() of the two. Drawn in colour.
  std::variant<std::monostate, MapChanges, MapDifference> changes{};
  std::vector<PageFoot> feet{};   ///< one of them is shown at a time
  std::vector<PagePlan> plans{};  ///< over this map
};

/// How write_page() writes.
struct PageOptions {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame
  std::optional<Eigen::Vector3d> suggested_up{};  ///< map frame: another, that the page offers to turn to
  double max_mb = 10;                             ///< 10⁶ bytes, of the file
  bool force = false;                             ///< write over a file that exists
};

/// What a page holds, for whoever wrote it.
struct PageReport {
  std::size_t bytes = 0;   ///< of the file
  std::size_t voxels = 0;  ///< of all maps, as they are drawn
  /// Edge of a drawn voxel in voxels of the map: 1 if nothing was merged, 0 if they were left out.
  int merged = 1;
  bool feet_left_out = false;  ///< contact regions, because there was no room for them
};

/// Whether this library was built with the page; without Node.js and the packages of web/ it is not.
bool has_page();

/// Writes one HTML page to look at the maps: turned, searched, measured, compared in any browser of 2023 or
/// later that has WebGL 2.
///
/// 1. The page is complete in itself. It fetches nothing, and its content security policy forbids it to.
/// 2. Planes, poses and standard deviations are in it to a double's last digit, polygons to 0.1 mm; free
///    space in horizontal slices every 0.1 m, or every voxel if voxels are larger.
/// 3. It is not larger than `max_mb`: if it would be, voxels are merged to 2 d, 4 d … 32 d, at last left out,
///    then contact regions, too, and the page says so. A merged voxel is there if one of its
///    voxels is, with the greatest of their log-odds and the surface that most of them belong to.
/// 4. The file is complete or not there; same maps, same bytes.
/// Throws Error(usage) if there is no map or a limit makes no sense, for a file that exists without `force`,
/// and without has_page(); Error(data) for numbers that are not finite, labels of other polygons, regions of
/// other surfaces and plans that are none; Error(output) if the surfaces alone are larger than `max_mb`, or
/// the file cannot be written.
PageReport write_page(const std::vector<PageMap>& maps, const std::filesystem::path& file,
                      const PageOptions& options = {});

/// A page that is in no file.
struct Page {
  std::string html;   ///< all of it, UTF-8
  PageReport report;  ///< what it holds
};

/// What write_page() writes, for a server to give. Throws as it does; `name` stands in errors where the file
/// would.
Page make_page(const std::vector<PageMap>& maps, const std::string& name, const PageOptions& options = {});

}  // namespace octosurf
