#include "geometry/directions.hpp"
#include "io/exporters/page_parts.hpp"
#include "io/exporters/page_template.hpp"
#include "io/new_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/page.hpp>

namespace octosurf {
namespace {

/// Level of detail of the maps on a page.
struct Detail {
  int merged;        ///< edge of a voxel in voxels of the map; 0: without voxels
  bool feet = true;  ///< with contact regions
};
constexpr std::array<Detail, 8> details{{{1}, {2}, {4}, {8}, {16}, {32}, {0}, {0, false}}};

/// The part of a map's data that is independent of the merging of its voxels.
struct MapOfPage {
  const PageMap& map;
  std::vector<io::PageVoxel> voxels;
};

std::string encoded(const MapOfPage& one, const std::vector<io::PageVoxel>& voxels, const Detail& detail,
                    const PageOptions& options) {
  const PageMap& map = one.map;
  io::PageBlock block;
  block.json["name"] = map.name;
  block.json["revision"] = map.snapshot->revision;
  block.json["resolution"] = map.snapshot->resolution;
  io::add_up(block, options.up);
  if (options.suggested_up) {
    const Eigen::Vector3d suggested = options.suggested_up->normalized();
    block.json["suggested_up"] = {suggested.x(), suggested.y(), suggested.z()};
  }
  block.json["merged"] = detail.merged;
  block.json["feet_left_out"] = !detail.feet && !map.feet.empty();
  block.json["voxels_before_merging"] = one.voxels.size();
  io::add_surfaces(block, map);
  if (detail.feet) io::add_feet(block, map);
  io::add_plans(block, map);
  if (detail.merged != 0) {
    const double size = map.octree.resolution() * detail.merged;
    io::add_voxels(block, voxels, size, *map.snapshot);
    io::add_slices(block, map.octree, voxels, size, options.up);
  }
  return block.encoded();
}

/// The encoded maps; empty if they exceed `room` bytes.
std::optional<std::string> maps_html(const std::vector<MapOfPage>& maps, const Detail& detail,
                                     const PageOptions& options, std::size_t room, PageReport& report) {
  const int merged = detail.merged;
  std::string html;
  report = {};
  for (const MapOfPage& one : maps) {
    std::vector<io::PageVoxel> larger;
    if (merged > 1) larger = io::merge_voxels(one.voxels, merged);
    const std::vector<io::PageVoxel>& voxels = merged > 1 ? larger : one.voxels;
    if (merged != 0) report.voxels += voxels.size();
    html += "<script type=\"application/octet-stream\" class=\"map\">" +
            encoded(one, voxels, detail, options) + "</script>\n";
    report.feet_left_out = report.feet_left_out || (!detail.feet && !one.map.feet.empty());
    if (html.size() > room) return std::nullopt;
  }
  report.merged = merged;
  return html;
}

std::string smallest_mb(std::size_t bytes) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", std::ceil(static_cast<double>(bytes) / 1e5) / 10);
  return text.data();
}

void check_page(const std::vector<PageMap>& maps, const std::string& name, const PageOptions& options) {
  if (!has_page())
    throw Error(
        Error::Kind::usage, name, "this octosurf was built without the page",
        "install Node.js and npm, run ./dev build (or npm ci in web/ and build anew); --png draws a picture");
  if (maps.empty()) throw Error(Error::Kind::usage, name, "has no map to show", "give one");
  if (!(std::isfinite(options.max_mb) && options.max_mb > 0))
    throw Error(Error::Kind::usage, "max_mb", "is not positive", "10 is the default");
  geometry::require_direction(options.up, "up");
  if (options.suggested_up) geometry::require_direction(*options.suggested_up, "suggested_up");
}

}  // namespace

bool has_page() { return !io::page_template().empty(); }

Page make_page(const std::vector<PageMap>& maps, const std::string& name, const PageOptions& options) {
  check_page(maps, name, options);
  const std::string_view page = io::page_template();
  const std::size_t mark = page.find(io::page_maps_mark);
  const std::string_view before = page.substr(0, mark), after = page.substr(mark + io::page_maps_mark.size());
  const auto limit = static_cast<std::size_t>(std::min(options.max_mb * 1e6, 1e15));
  const std::size_t frame = before.size() + after.size(), room = limit > frame ? limit - frame : 0;

  std::vector<MapOfPage> all;
  for (const PageMap& map : maps) all.push_back({map, io::occupied_voxels(map.octree)});
  PageReport report;
  std::optional<std::string> html;
  for (const Detail& detail : details) {
    html = maps_html(all, detail, options, room, report);
    if (html) break;
  }
  if (!html) {
    const std::size_t least =
        frame + maps_html(all, details.back(), options, static_cast<std::size_t>(-1), report)->size();
    throw Error(Error::Kind::output, name, "would be larger than allowed even without voxels",
                "allow " + smallest_mb(least) + " MB (--max-mb)");
  }
  report.bytes = frame + html->size();
  return {std::string(before).append(*html).append(after), report};
}

PageReport write_page(const std::vector<PageMap>& maps, const std::filesystem::path& file,
                      const PageOptions& options) {
  check_page(maps, file.string(), options);
  io::NewFile output(file, options.force);  // opened first, because writing a page takes a while
  const Page page = make_page(maps, file.string(), options);
  output.write([&](std::ostream& out) { out << page.html; });
  output.commit();
  return page.report;
}

}  // namespace octosurf
