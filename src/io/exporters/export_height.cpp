#include "io/exporters/export_formats.hpp"
#include "io/exporters/grid_map_message.hpp"
#include "io/new_file.hpp"
#include "io/png_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/planner_formats.hpp>

namespace octosurf {
namespace {

/// height = offset + scale · value; value 0 is an empty cell, 1 the lowest height.
struct HeightScale {
  double offset = 0, scale = 0;
};

HeightScale scale_of(const Eigen::MatrixXf& elevation) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const float height : elevation.reshaped()) {
    if (std::isnan(height)) continue;
    low = std::min(low, static_cast<double>(height));
    high = std::max(high, static_cast<double>(height));
  }
  if (!(low <= high)) return {0, 1e-4};
  // A tenth of a millimetre a step, unless the map is higher than the 6.5 m that this covers.
  const double scale = std::max(1e-4, (high - low) / 65534);
  return {low - scale, scale};
}

std::vector<std::uint16_t> pixels_of(const Eigen::MatrixXf& elevation, const HeightScale& scale) {
  // The grid's columns run against y, as an image's rows do; its rows run against x, the image's columns
  // along it.
  std::vector<std::uint16_t> pixels;
  pixels.reserve(static_cast<std::size_t>(elevation.size()));
  for (Eigen::Index column = 0; column < elevation.cols(); ++column)
    for (Eigen::Index row = elevation.rows() - 1; row >= 0; --row) {
      const auto height = static_cast<double>(elevation(row, column));
      pixels.push_back(std::isnan(height)
                           ? std::uint16_t{0}
                           : static_cast<std::uint16_t>(
                                 std::clamp(std::lround((height - scale.offset) / scale.scale), 1L, 65535L)));
    }
  return pixels;
}

}  // namespace

void export_height_image(const HeightGrid& grid, const std::filesystem::path& file, bool force) {
  if (io::ending_of(file) != ".png")
    throw Error(Error::Kind::usage, file.string(), "a height image is a PNG", "end the name in .png");
  io::require_cells(grid, file);
  const HeightScale scale = scale_of(grid.elevation);
  const Eigen::Vector2d first = grid.center_of(grid.elevation.rows() - 1, 0);
  const auto width = static_cast<int>(grid.elevation.rows()),
             height = static_cast<int>(grid.elevation.cols());
  const nlohmann::ordered_json about{{"format", "octosurf-height"},
                                     {"version", 1},
                                     {"image", file.filename().string()},
                                     {"width", width},
                                     {"height", height},
                                     {"scale", scale.scale},
                                     {"offset", scale.offset},
                                     {"no_data", 0},
                                     {"cell", grid.cell},
                                     {"origin", first}};
  io::NewFile image(file, force), text(std::filesystem::path(file).replace_extension(".json"), force);
  image.write(
      [&](std::ostream& out) { io::write_png(pixels_of(grid.elevation, scale), width, height, out); });
  // A file's name may be invalid UTF-8; the bytes in question are replaced.
  const std::string document = about.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  text.write([&](std::ostream& out) { out << document << '\n'; });
  text.commit();
  image.commit();
}

}  // namespace octosurf
