#pragma once

#include <optional>
#include <string>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// Parameters from a command line: flags override the config file.
struct ParameterOptions {
  struct Setting {
    std::string name, text;
    std::string where;  ///< "FILE:LINE: " for a config file's
  };
  std::string config;  ///< lines `name = value`, # comments; the last one counts
  std::vector<Setting> flags;
};

/// Adds --config, and every parameter as a flag, spelled with _ and with -.
void add_parameter_options(CLI::App& verb, ParameterOptions& options);

/// The user's choice of parameters, not yet applied.
class ParameterChoice {
 public:
  /// Reads the config file. Throws Error(data), Error(usage). `live`: for scans that arrive in real time;
  /// unless it is given, a new map has a detection_budget.
  explicit ParameterChoice(const ParameterOptions& options, bool live = false);

  /// For a new map, validated. With the paper's detector those not given are the paper's. `resolution`: of an
  /// existing octree; else, unless given, 2 cm for a camera, 5 cm for a lidar. Throws Error(usage).
  Parameters in_force(std::optional<double> resolution = {},
                      SensorKind sensor = SensorKind::depth_camera) const;
  /// A line on the resolution of a sensor's map; empty: it is given.
  std::string said_of(SensorKind sensor) const;

  /// Throws Error(usage) if a choice differs from a resumed map's parameters. `up` may differ, because it
  /// does not affect mapping.
  void require_same(const Parameters& of_map) const;

  /// `up` for a resumed map: the user's choice, else the map's.
  std::optional<Eigen::Vector3d> up_over(const Parameters& of_map) const;

 private:
  bool given(const std::string& name) const;
  Parameters apply_to(Parameters parameters) const;

  bool live_;
  std::vector<ParameterOptions::Setting> settings_;  ///< config file, then flags
};

}  // namespace octosurf
