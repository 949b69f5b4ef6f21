#include "geometry/directions.hpp"
#include "io/exporters/page_messages.hpp"
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

std::string script(const std::string& message) {
  return "<script type=\"application/octet-stream\" class=\"map\">" + io::base64(message) + "</script>\n";
}

/// Of each map the part that is independent of the merging of its voxels.
std::vector<std::string> surfaces_html(const std::vector<PageMap>& maps, const PageOptions& options,
                                       bool feet) {
  std::vector<std::string> parts;
  io::SurfacesMessage how;
  how.up = options.up;
  how.suggested_up = options.suggested_up;
  how.feet = feet;
  for (const PageMap& map : maps) parts.push_back(script(io::surfaces_message(map, how)));
  return parts;
}

/// All maps with merged voxels; empty if they exceed `room` bytes.
std::optional<std::string> maps_html(const std::vector<PageMap>& maps,
                                     const std::vector<std::string>& surfaces,
                                     const std::vector<std::vector<io::PageVoxel>>& voxels, int merged,
                                     const PageOptions& options, std::size_t room, PageReport& report) {
  std::string html;
  report.merged = merged;
  report.voxels = 0;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const io::VoxelsMessage drawn = io::voxels_message(maps[i], voxels[i], merged, options.up, true);
    html += surfaces[i] + script(drawn.packed);
    report.voxels += drawn.voxels;
    if (html.size() > room) return std::nullopt;
  }
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

  std::vector<std::vector<io::PageVoxel>> voxels;
  for (const PageMap& map : maps) voxels.push_back(io::occupied_voxels(map.octree));
  std::vector<std::string> surfaces = surfaces_html(maps, options, true);
  PageReport report;
  std::optional<std::string> html;
  for (const int merged : io::voxel_merges)
    if (!html) html = maps_html(maps, surfaces, voxels, merged, options, room, report);
  if (!html) {
    for (const PageMap& map : maps) report.feet_left_out = report.feet_left_out || !map.feet.empty();
    surfaces = surfaces_html(maps, options, false);
    html = maps_html(maps, surfaces, voxels, 0, options, static_cast<std::size_t>(-1), report);
    if (html->size() > room)
      throw Error(Error::Kind::output, name, "would be larger than allowed even without voxels",
                  "allow " + smallest_mb(frame + html->size()) + " MB (--max-mb)");
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
