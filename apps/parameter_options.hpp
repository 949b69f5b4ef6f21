#pragma once

#include <optional>
#include <string>
#include <vector>

#include <octosurf/parameters.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// Parameters as a command line gives them: flags win over the config file, that over the preset.
struct ParameterOptions {
  struct Setting {
    std::string name, text;
    std::string where;  ///< "FILE:LINE: " for a config file's
  };
  std::optional<std::string> preset;  ///< default or paper
  std::string config;                 ///< lines `name = value`, # comments; a later line wins
  std::vector<Setting> flags;
};

/// Adds --preset, --config, and every parameter as a flag, spelled with _ and with -.
void add_parameter_options(CLI::App& verb, ParameterOptions& options);

/// What the user asked for, not yet applied to anything.
class ParameterChoice {
 public:
  /// Reads the config file. Throws Error(data) if it cannot be read, Error(usage) naming file and line
  /// for a line that is none, and for unknown names and values that make no sense.
  explicit ParameterChoice(const ParameterOptions& options);

  /// The parameters in force for a new map, validated. With the paper's preset, s follows d and the
  /// sensor noise unless it is given. `resolution`: of an octree that is already there.
  /// Throws Error(usage), also if another resolution was asked for.
  Parameters in_force(std::optional<double> resolution = {}) const;

  /// Throws Error(usage) if something else was asked for than what a map that is gone on with has. `up`
  /// may differ, because nothing is mapped otherwise for it.
  void require_same(const Parameters& of_map) const;

  /// `up` for a map that is gone on with: what was asked for, else the map's.
  std::optional<Eigen::Vector3d> up_over(const Parameters& of_map) const;

 private:
  bool given(const std::string& name) const;
  Parameters apply_to(Parameters parameters) const;

  std::optional<std::string> preset_;
  std::vector<ParameterOptions::Setting> settings_;  ///< config file, then flags
};

/// `name value unit`, a line for each parameter in force.
std::string list_parameters(const Parameters& parameters);

}  // namespace octosurf
