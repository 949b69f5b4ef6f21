#pragma once

#include <Eigen/Geometry>
#include <string>

namespace octosurf {

/// When a run saves its outputs.
enum class Saving {
  checkpoint,  ///< a failure is a warning, as the next may succeed
  end          ///< of the run, also where it failed
};

/// Writes the poses with which a run's scans were mapped (`--write-poses`).
class PoseLog {
 public:
  /// None if `file` is empty. `force`: overwrite a file from before the run. `origin`: of the map, added to
  /// the poses. Throws as save() for a file that cannot be replaced.
  PoseLog(std::string file, bool force, const Eigen::Vector3d& origin);

  void add(double stamp_s, const Eigen::Isometry3d& T_map_sensor);
  /// Writes all poses so far. Throws Error(output), Error(usage); of a checkpoint it warns once instead.
  void save(Saving saving);

 private:
  std::string file_;
  bool force_, failing_ = false;
  Eigen::Vector3d origin_;
  std::string lines_;
};

}  // namespace octosurf
