#include "up_option.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>

namespace octosurf {
namespace {

// From here on the second-best direction scores as if its surfaces were read half again as large: too near
// to be called known.
constexpr double doubtful_rival = 2.0 / 3;

}  // namespace

void add_up_option(CLI::App& verb, std::string& text) {
  verb.add_option("--up", text,
                  "X Y Z, an axis such as -y, or auto (from the surfaces): up, if not the map's own")
      ->type_name("DIRECTION");
}

Up up_in_force(const Map& map, const std::string& text) {
  if (text.empty()) return up_of(map);
  Parameters parameters;
  set_parameter(parameters, "up", text);
  return parameters.up ? Up{*parameters.up, Up::Source::given, 0, 0} : up_from_surfaces(map);
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
