#pragma once

#include "io/exporters/foxglove_log.hpp"
#include "io/new_file.hpp"

#include <Eigen/Geometry>
#include <fstream>
#include <optional>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {

/// Records the surfaces and sensor poses of a run over time, as a file for Foxglove (`--mcap`). Written
/// during mapping, and put in place by save().
class SceneLog {
 public:
  /// No file is written if `file` is empty. `up`: map frame. Throws Error(output), Error(usage).
  SceneLog(std::string file, bool force, const Eigen::Vector3d& up);

  // A failed write is reported once on stderr; the run continues.
  void add_pose(double stamp_s, const Eigen::Isometry3d& T_map_sensor);
  void add_surfaces(double stamp_s, const Mapper& mapper);

  /// Adds all surfaces and finishes the file; throws Error(output), Error(usage).
  void save(double stamp_s, const Snapshot& snapshot);

 private:
  Error failure() const;
  void warn_of_failure();

  std::string name_;
  std::ofstream out_;
  std::optional<io::NewFile> file_;
  std::optional<io::FoxgloveLog> log_;
  bool failing_ = false;
};

}  // namespace octosurf
