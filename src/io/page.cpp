#include "io/new_file.hpp"
#include "io/page_parts.hpp"
#include "io/page_template.hpp"
#include "surfaces/directions.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/page.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

constexpr std::array<int, 7> merges{1, 2, 4, 8, 16, 32, 0};  // 0: without voxels

/// What of a map is the same whatever its voxels are merged to.
struct MapOfPage {
  const PageMap& map;
  std::vector<PageVoxel> voxels;
};

std::string encoded(const MapOfPage& one, const std::vector<PageVoxel>& voxels, int merged,
                    const PageOptions& options) {
  const PageMap& map = one.map;
  const Eigen::Vector3d up = options.up.normalized();
  const Eigen::Quaterniond R_upright_map = upright(up);
  PageBlock block;
  block.json["name"] = map.name;
  block.json["revision"] = map.snapshot->revision;
  block.json["resolution"] = map.snapshot->resolution;
  block.json["up"] = {up.x(), up.y(), up.z()};
  // So that heights in the page and its slices are those of up.hpp.
  block.json["R_upright_map"] = {R_upright_map.x(), R_upright_map.y(), R_upright_map.z(), R_upright_map.w()};
  block.json["merged"] = merged;
  block.json["voxels_before_merging"] = one.voxels.size();
  add_surfaces(block, map);
  if (merged != 0) {
    const double size = map.octree.resolution() * merged;
    add_voxels(block, voxels, size, *map.snapshot);
    add_slices(block, map.octree, voxels, size, options.up);
  }
  return block.encoded();
}

/// The page's maps with voxels merged so; nothing if they take more than `room` bytes.
std::optional<std::string> maps_html(const std::vector<MapOfPage>& maps, int merged,
                                     const PageOptions& options, std::size_t room, PageReport& report) {
  std::string html;
  report.voxels = 0;
  for (const MapOfPage& one : maps) {
    std::vector<PageVoxel> larger;
    if (merged > 1) larger = merge_voxels(one.voxels, merged);
    const std::vector<PageVoxel>& voxels = merged > 1 ? larger : one.voxels;
    if (merged != 0) report.voxels += voxels.size();
    html += "<script type=\"application/octet-stream\" class=\"map\">" +
            encoded(one, voxels, merged, options) + "</script>\n";
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

void check(const std::vector<PageMap>& maps, const std::string& name, const PageOptions& options) {
  if (!has_page())
    throw Error(
        Error::Kind::usage, name, "this octosurf was built without the page",
        "install Node.js and npm, run ./dev build (or npm ci in web/ and build anew); --png draws a picture");
  if (maps.empty()) throw Error(Error::Kind::usage, name, "has no map to show", "give one");
  if (!(std::isfinite(options.max_mb) && options.max_mb > 0))
    throw Error(Error::Kind::usage, "max_mb", "is not positive", "10 is the default");
  require_direction(options.up, "up");
}

}  // namespace

bool has_page() { return !page_template().empty(); }

Page make_page(const std::vector<PageMap>& maps, const std::string& name, const PageOptions& options) {
  check(maps, name, options);
  const std::string_view page = page_template();
  const std::size_t mark = page.find(page_maps_mark);
  const std::string_view before = page.substr(0, mark), after = page.substr(mark + page_maps_mark.size());
  const auto limit = static_cast<std::size_t>(std::min(options.max_mb * 1e6, 1e15));
  const std::size_t frame = before.size() + after.size(), room = limit > frame ? limit - frame : 0;

  std::vector<MapOfPage> all;
  for (const PageMap& map : maps) all.push_back({map, occupied_voxels(map.octree)});
  PageReport report;
  std::optional<std::string> html;
  for (const int merged : merges) {
    html = maps_html(all, merged, options, room, report);
    if (html) break;
  }
  if (!html) {
    const std::size_t least =
        frame + maps_html(all, 0, options, static_cast<std::size_t>(-1), report)->size();
    throw Error(Error::Kind::output, name, "would be larger than allowed even without voxels",
                "allow " + smallest_mb(least) + " MB (--max-mb)");
  }
  report.bytes = frame + html->size();
  return {std::string(before).append(*html).append(after), report};
}

PageReport write_page(const std::vector<PageMap>& maps, const std::filesystem::path& file,
                      const PageOptions& options) {
  check(maps, file.string(), options);
  NewFile output(file, options.force);  // first, because a page takes a while
  const Page page = make_page(maps, file.string(), options);
  output.write([&](std::ostream& out) { out << page.html; });
  output.commit();
  return page.report;
}

}  // namespace octosurf
