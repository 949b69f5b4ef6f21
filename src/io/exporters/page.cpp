#include "geometry/directions.hpp"
#include "io/exporters/page_messages.hpp"
#include "io/exporters/page_template.hpp"
#include "io/new_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/page.hpp>

namespace octosurf {
namespace {

std::string script(const std::string& message) {
  return "<script type=\"application/octet-stream\" class=\"map\">" + io::base64(message) + "</script>\n";
}

std::string smallest_mb(std::size_t bytes) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", std::ceil(static_cast<double>(bytes) / 1e5) / 10);
  return text.data();
}

void check_page(const std::string& name, const PageOptions& options) {
  if (!has_page())
    throw Error(
        Error::Kind::usage, name, "this octosurf was built without the page",
        "install Node.js and npm, run ./dev build (or npm ci in web/ and build anew); --png draws a picture");
  if (!(std::isfinite(options.max_mb) && options.max_mb > 0))
    throw Error(Error::Kind::usage, "max_mb", "is not positive", "10 is the default");
  geometry::require_direction(options.up, "up");
  if (options.suggested_up) geometry::require_direction(*options.suggested_up, "suggested_up");
}

}  // namespace

bool has_page() { return !io::page_template().empty(); }

Page make_page(const PageMap& map, const std::string& name, const PageOptions& options) {
  check_page(name, options);
  const std::string_view page = io::page_template();
  const std::size_t mark = page.find(io::page_map_mark);
  const std::string_view before = page.substr(0, mark), after = page.substr(mark + io::page_map_mark.size());
  io::SurfacesMessage how{options.up, options.suggested_up};
  std::string surfaces = script(io::surfaces_message(map, how)), voxels;
  const auto bytes = [&] { return before.size() + surfaces.size() + voxels.size() + after.size(); };
  const auto fits = [&] { return static_cast<double>(bytes()) <= options.max_mb * 1e6; };
  const std::vector<io::PageVoxel> all = io::occupied_voxels(map.octree);
  PageReport report;
  for (const int merged : io::voxel_merges) {
    const io::VoxelsMessage drawn = io::voxels_message(map, all, merged);
    voxels = script(drawn.packed);
    report.merged = merged;
    report.voxels = drawn.voxels;
    if (fits()) break;
  }
  if (!fits()) {
    report.feet_left_out = !map.feet.empty();
    how.feet = false;
    surfaces = script(io::surfaces_message(map, how));
  }
  if (!fits())
    throw Error(Error::Kind::output, name, "would be larger than allowed even without voxels",
                "allow " + smallest_mb(bytes()) + " MB (--max-mb)");
  report.bytes = bytes();
  return {std::string(before).append(surfaces).append(voxels).append(after), report};
}

PageReport write_page(const PageMap& map, const std::filesystem::path& file, const PageOptions& options) {
  check_page(file.string(), options);
  io::NewFile output(file, options.force);  // opened first, because writing a page takes a while
  const Page page = make_page(map, file.string(), options);
  output.write([&](std::ostream& out) { out << page.html; });
  output.commit();
  return page.report;
}

}  // namespace octosurf
