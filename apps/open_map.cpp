#include "open_map.hpp"

#include "io/text_file.hpp"
#include "output_files.hpp"
#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <optional>

namespace octosurf {
namespace {

// Of 45°: a direction farther off is another axis, not a slope.
constexpr double cos_another = 0.70710678118654752;
// Of 10°: floors and frames are aligned with an axis more accurately.
constexpr double cos_along_axis = 0.98480775301220806;

/// "y" or "-y" where it is nearly one, else its numbers.
std::string axis_name(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  if (std::fabs(direction[axis]) >= cos_along_axis)
    return (direction[axis] < 0 ? "-" : "") + std::string(1, static_cast<char>('x' + axis));
  return io::formatted("%.2f %.2f %.2f", direction.x(), direction.y(), direction.z());
}

}  // namespace

LoadedMap load_with_warning(const std::string& name) {
  LoadedMap loaded = load_map(name);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  return loaded;
}

LoadedMap open_map(const std::string& name) {
  LoadedMap loaded = load_with_warning(name);
  if (const Eigen::Vector3d origin = loaded.map.origin(); !origin.isZero(0))
    std::fprintf(stderr, "origin: coordinates are less %s m, as those of the poses were too far from 0\n",
                 io::text_of(origin).c_str());
  return loaded;
}

bool writes_over(const std::string& read, const std::string& written) {
  return same_file(files_of_map(read).front(), files_of_map(written).front());
}

void add_up_option(CLI::App& verb, std::string& text) {
  verb.add_option("--up", text,
                  "which way is up: X Y Z, an axis such as -y, or auto (from the surfaces) [the map's own]")
      ->type_name("DIRECTION");
}

Up up_in_force(const Map& map, const std::string& text) {
  if (text.empty()) return up_of(map);
  Parameters parameters;
  set_parameter(parameters, "up", text);
  return parameters.up ? Up{*parameters.up, Up::Source::given} : up_from_surfaces(map);
}

planning::AskedMap asked_map(const LoadedMap& loaded, const std::string& name, const std::string& up) {
  return {name, loaded.map.snapshot(), loaded.map.octree(), up_in_force(loaded.map, up).direction};
}

namespace {

/// What surfaces alone say against a direction: the largest level one is seen from below, and none below it
/// from above; or none is level to 15°, and most of their area is not upright either.
std::string doubt_of_up(const Snapshot& snapshot, const Eigen::Vector3d& up) {
  constexpr double cos_level = 0.966;
  SurfacePtr level;
  double leaning = 0;  // m², more than is level or upright
  for (const SurfacePtr& surface : snapshot.surfaces) {
    const double cosine = std::fabs(surface->plane.normal.dot(up)),
                 sine = std::sqrt(std::max(0., 1 - cosine * cosine));
    leaning += (std::max(cosine, sine) < cos_level ? 1 : -1) * surface->area_m2;
    if (cosine >= cos_level && (!level || surface->area_m2 > level->area_m2)) level = surface;
  }
  if (!level)
    return leaning > 0 ? "nothing is level within 15 degrees of up, " + axis_name(up) +
                             ": --up auto, or level the poses"
                       : "";
  // Heights are offsets along the normal: the level one's faces down.
  const auto is_floor = [&](const SurfacePtr& surface) {
    return surface->plane.normal.dot(up) >= cos_level && surface->plane.offset < -level->plane.offset;
  };
  if (level->plane.normal.dot(up) > 0 || std::ranges::any_of(snapshot.surfaces, is_floor)) return "";
  return io::formatted(
             "the largest level surface, %ju (%.1f m²), is seen from below, and no floor from above: ",
             level->id, level->area_m2) +
         "--up " + axis_name(-up) +
         " if the map is upside down; else the sensor's place in its frame is wrong";
}

}  // namespace

void warn_of_up(const Map& map) {
  const std::optional<Eigen::Vector3d>& given = map.parameters().up;
  if (!given) return;
  const Up found = up_from_surfaces(map);
  // Clouds without poses were never turned, so their frame tells nothing.
  const surfaces::MapState& state = surfaces::state_of(map);
  const Eigen::Vector3d& held = state.sensors_up;
  const bool turned = held.normalized().dot(Eigen::Vector3d::UnitZ()) < 1 - 1e-9;
  const bool steady = held.norm() > static_cast<double>(state.scans) / 2;
  const bool another = found.source == Up::Source::surfaces && found.direction.dot(*given) <= cos_another;
  if (another && turned && steady && held.dot(found.direction) >= cos_another * held.norm()) {
    std::fprintf(stderr, "warning: surfaces and sensors suggest that up is %s, not %s: --up auto\n",
                 axis_name(found.direction).c_str(), axis_name(*given).c_str());
    return;
  }
  if (const std::string doubt = doubt_of_up(*map.snapshot(), given->normalized()); !doubt.empty())
    std::fprintf(stderr, "warning: %s\n", doubt.c_str());
}

std::string describe(const Up& up) {
  const std::string direction =
      io::formatted("%.4f %.4f %.4f", up.direction.x(), up.direction.y(), up.direction.z());
  if (up.source == Up::Source::assumed) return direction + ", assumed: no surface tells";
  return direction + (up.source == Up::Source::given ? "" : ", estimated from level surfaces");
}

}  // namespace octosurf
