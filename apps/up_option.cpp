#include "up_option.hpp"

#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

namespace octosurf {
namespace {

// From here on the second-best direction scores at least two thirds of the best: ambiguous.
constexpr double doubtful_rival = 2.0 / 3;
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
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.2f %.2f %.2f", direction.x(), direction.y(), direction.z());
  return text.data();
}

/// m²: of the surfaces level to within 5°, as up_from_surfaces() counts them.
double level_area(const Map& map, const Eigen::Vector3d& up) {
  double area = 0;
  for (const SurfacePtr& surface : map.snapshot()->surfaces) {
    const double slope = slope_rad(*surface, up);
    if (std::min(slope, std::numbers::pi - slope) <= 5 * std::numbers::pi / 180) area += surface->area_m2;
  }
  return area;
}

}  // namespace

void add_up_option(CLI::App& verb, std::string& text) {
  verb.add_option("--up", text,
                  "which way is up: X Y Z, an axis such as -y, or auto (from the surfaces) [the map's own]")
      ->type_name("DIRECTION");
}

Up up_in_force(const Map& map, const std::string& text) {
  if (text.empty()) return up_of(map);
  Parameters parameters;
  set_parameter(parameters, "up", text);
  return parameters.up ? Up{*parameters.up, Up::Source::given, 0, 0} : up_from_surfaces(map);
}

std::optional<Up> suggested_up(const Map& map, const std::string& text) {
  const std::optional<Eigen::Vector3d>& given = map.parameters().up;
  if (!text.empty() || !given) return std::nullopt;
  const Up found = up_from_surfaces(map);
  // Sensors that were turned, but on average held upright by the map's up, confirm it. Clouds without poses
  // were never turned, so they confirm nothing.
  const Eigen::Vector3d& held = surfaces::state_of(map).sensors_up;
  const bool turned = held.normalized().dot(Eigen::Vector3d::UnitZ()) < 1 - 1e-9;
  const bool held_upright = turned && held.norm() > static_cast<double>(surfaces::state_of(map).scans) / 2 &&
                            held.dot(*given) > cos_another * held.norm();
  if (found.source != Up::Source::surfaces || found.rival > doubtful_rival || held_upright ||
      found.direction.dot(*given) > cos_another)
    return std::nullopt;
  // Without sensor orientations, wall area can outvote the floor.
  const bool held_so = turned && held.dot(found.direction) > cos_another * held.norm();
  if (!held_so && found.level_m2 < 2 * level_area(map, *given)) return std::nullopt;
  return found;
}

void warn_of_up(const Map& map, const std::string& text) {
  const std::optional<Up> found = suggested_up(map, text);
  if (!found) return;
  std::fprintf(stderr, "warning: surfaces suggest that up is %s (%.1f m² level), not %s: --up auto\n",
               axis_name(found->direction).c_str(), found->level_m2, axis_name(*map.parameters().up).c_str());
}

std::string describe(const Up& up) {
  std::array<char, 128> direction{}, how{};
  std::snprintf(direction.data(), direction.size(), "%.4f %.4f %.4f", up.direction.x(), up.direction.y(),
                up.direction.z());
  if (up.source == Up::Source::assumed) return std::string(direction.data()) + ", assumed: no surface tells";
  if (up.source == Up::Source::given) return direction.data();
  std::snprintf(how.data(), how.size(), ", estimated from %.2f m² of level surfaces%s", up.level_m2,
                up.rival > doubtful_rival ? "; doubtful, give it by --up" : "");
  return std::string(direction.data()) + how.data();
}

}  // namespace octosurf
