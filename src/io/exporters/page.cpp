#include "geometry/directions.hpp"
#include "io/exporters/page_messages.hpp"
#include "io/exporters/page_template.hpp"
#include "io/text_file.hpp"

#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

std::string script(const std::string& message) {
  return "<script type=\"application/octet-stream\" class=\"map\">" + io::base64(message) + "</script>\n";
}

void check_page(const PageMap& map, const PageOptions& options) {
  if (io::page_template().empty())
    throw Error(
        Error::Kind::usage, map.name, "this octosurf was built without the page",
        "install Node.js and npm, run ./dev build (or npm ci in web/ and build anew); --png draws a picture");
  if (!(std::isfinite(options.max_mb) && options.max_mb > 0))
    throw Error(Error::Kind::usage, "max_mb", "is not positive", "10 is the default");
  geometry::require_direction(options.up, "up");
}

}  // namespace

std::string make_page(const PageMap& map, const PageOptions& options) {
  check_page(map, options);
  const std::string_view page = io::page_template();
  const std::size_t mark = page.find(io::page_map_mark);
  const std::string_view before = page.substr(0, mark), after = page.substr(mark + io::page_map_mark.size());
  const std::string surfaces = script(io::surfaces_message(map, options.up).packed());
  std::string voxels = script({});
  const auto left = [&] {
    return options.max_mb * 1e6 -
           static_cast<double>(before.size() + surfaces.size() + voxels.size() + after.size());
  };
  voxels = script(io::voxels_message(map, 0.75 * left()));  // base64 has 4 bytes for 3
  if (left() < 0)
    throw Error(
        Error::Kind::output, map.name, "makes a page larger than allowed even without voxels",
        io::formatted("allow %.1f MB (--max-mb)", std::ceil(10 * (options.max_mb - left() / 1e6)) / 10));
  return std::string(before).append(surfaces).append(voxels).append(after);
}

}  // namespace octosurf
