#include "parameter_options.hpp"

#include "bounds.hpp"
#include "io/text_file.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string_view>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

using Setting = ParameterOptions::Setting;
constexpr int budget_in_real_time = 1000;  // readings, see DetectionParameters::detection_budget
constexpr std::size_t most_columns = 100;  // of a line of help, before the next name
/// Which help lists; it names the others.
constexpr std::array<std::string_view, 4> often_set{"resolution", "max_range", "detector", "align"};
constexpr std::size_t largest_config = std::size_t{64} << 10;  // bytes; all parameters are a hundredth of it

std::string with(std::string name, char from, char to) {
  std::ranges::replace(name, from, to);
  return name;
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<Setting> read_config(const std::string& file) {
  std::vector<Setting> settings;
  std::istringstream lines(io::read_bytes(file, largest_config));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    const std::string where = file + ":" + std::to_string(number);
    const auto equals = line.find('=');
    if (equals == std::string::npos)
      throw Error(Error::Kind::usage, where, "'" + line + "' is not of the form name = value");
    settings.push_back(
        {with(trimmed(line.substr(0, equals)), '-', '_'), trimmed(line.substr(equals + 1)), where + ": "});
  }
  return settings;
}

/// set_parameter, with the config file's line named in errors.
void set(Parameters& parameters, const Setting& setting) {
  try {
    set_parameter(parameters, setting.name, setting.text);
  } catch (const Error& error) {
    if (setting.where.empty()) throw;
    throw Error(error.kind(), "", setting.where + error.what());
  }
}

/// An error may be caused by a given parameter: it is named if it alone causes it, too.
void validate(const Parameters& parameters, const std::vector<Setting>& settings) {
  try {
    parameters.validate();
  } catch (const Error& error) {
    const auto is_refused = [&](const Setting& s) { return s.name == error.where(); };
    if (std::ranges::any_of(settings, is_refused)) throw;
    for (const Setting& setting : settings) {
      Parameters alone;
      set(alone, setting);
      try {
        alone.validate();
      } catch (const Error& follows) {
        const std::string what = follows.what();
        throw Error(
            error.kind(), setting.name,
            "is " + setting.text + ", so that " + follows.where() + what.substr(follows.where().size() + 1));
      }
    }
    throw;
  }
}

}  // namespace

void add_parameter_options(CLI::App& verb, ParameterOptions& options) {
  verb.add_option("--config", options.config,
                  "file with lines 'name = value' and # comments; flags override it")
      ->type_name("FILE");
  verb.add_option_function<std::string>(
          "--up",
          [&options](const std::string& text) {
            options.flags.push_back({"up", text, {}});
          },
          "against gravity: X Y Z, an axis such as -y, or auto: from the surfaces [z]")
      ->type_name("DIRECTION")
      ->group("Parameters [default]");
  const Parameters defaults;
  std::string others = "\n ";
  for (const ParameterInfo& info : parameter_infos()) {
    if (info.name.starts_with("up_")) continue;  // --up gives all three
    const std::string dashed = with(info.name, '_', '-');
    const std::string names = "--" + info.name + (dashed == info.name ? "" : ",--" + dashed);
    const bool often = std::ranges::find(often_set, info.name) != often_set.end();
    if (!often) others += (others.size() - others.rfind('\n') > most_columns ? "\n  " : " ") + dashed;
    const std::string help = info.help + " [" + get_parameter(defaults, info.name) +
                             (info.unit.empty() ? "" : " " + info.unit) + "]";
    verb.add_option_function<std::string>(
            names,
            [&options, name = info.name](const std::string& text) {
              options.flags.push_back({name, text, {}});
            },
            help)
        ->type_name("VALUE")
        ->group(often ? "Parameters [default]" : rare_group);
  }
  leave_out_rare(verb);
  verb.footer(verb.get_footer() + "Parameters, too, as flags or in --config:" + others +
              ". docs/parameters.md describes them.\n");
}

ParameterChoice::ParameterChoice(const ParameterOptions& options, bool live) : live_(live) {
  if (!options.config.empty()) settings_ = read_config(options.config);
  settings_.insert(settings_.end(), options.flags.begin(), options.flags.end());
  apply_to(Parameters());  // rejects unknown names and invalid values
}

bool ParameterChoice::given(const std::string& name) const {
  return std::ranges::any_of(settings_, [&](const Setting& s) { return s.name == name; });
}

Parameters ParameterChoice::apply_to(Parameters parameters) const {
  for (const Setting& setting : settings_) set(parameters, setting);
  return parameters;
}

Parameters ParameterChoice::in_force(std::optional<double> resolution, SensorKind sensor) const {
  Parameters usual;
  // A lidar's readings are noisier, and farther apart, than 2 cm.
  if (sensor == SensorKind::lidar) usual.occupancy.resolution = 0.05;
  Parameters parameters = apply_to(usual);
  if (parameters.detection.detector == DetectorKind::paper)
    parameters = apply_to(Parameters::paper(resolution.value_or(parameters.occupancy.resolution),
                                            parameters.surfaces.sensor_noise));
  double& d = parameters.occupancy.resolution;
  if (resolution && given("resolution") && std::fabs(d - *resolution) > 1e-9)
    throw Error(Error::Kind::usage, "resolution",
                io::formatted("is %g, but the octree of the input has %g m", d, *resolution), "leave it out");
  if (resolution) d = *resolution;
  if (live_ && !given("detection_budget")) parameters.detection.detection_budget = budget_in_real_time;
  validate(parameters, settings_);
  return parameters;
}

std::string ParameterChoice::said_of(SensorKind sensor) const {
  if (given("resolution")) return {};
  return sensor == SensorKind::lidar
             ? "resolution: 5 cm, as of a lidar's scans; --resolution states another"
             : "resolution: 2 cm, as of a camera's scans; --resolution states another";
}

void ParameterChoice::require_same(const Parameters& of_map) const {
  const Parameters asked = apply_to(of_map);
  for (const ParameterInfo& info : parameter_infos()) {
    if (info.name.starts_with("up_") || !given(info.name)) continue;
    const std::string value = get_parameter(asked, info.name), kept = get_parameter(of_map, info.name);
    if (value != kept)
      throw Error(Error::Kind::usage, info.name, "is " + value + ", but the map that is resumed has " + kept,
                  "leave it out, or start a new map");
  }
}

std::optional<Eigen::Vector3d> ParameterChoice::up_over(const Parameters& of_map) const {
  const Parameters parameters = apply_to(of_map);
  parameters.validate();
  return parameters.up;
}

}  // namespace octosurf
