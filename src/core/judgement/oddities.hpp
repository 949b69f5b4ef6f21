#pragma once

#include "judgement/spread.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::judgement {

/// Scans that stand out without being compared with others. That does not make them wrong: a camera may skip
/// an image, a robot stand still, a second session begin elsewhere. Their views tell.
class Oddities {
 public:
  enum Kind : std::size_t { same_readings, identity, same_pose };
  static constexpr std::size_t kinds = 3;

  /// A scan as given, where it was mapped, and m: how far turns move what it sees.
  std::optional<Kind> add(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, double lever_m);

  struct Step {
    std::size_t scan = 0;  ///< the one after it
    std::string name;
    double length_m = 0;
  };
  /// The longest of those that stand out from the steps beside them, if it is longer than `least_m`.
  std::optional<Step> longest_step(double least_m) const;
  double median_step_m() const;  ///< of positions

 private:
  struct Move {
    double length_m = 0, seconds = 0;
    std::string name;
  };
  void note_move(Move move);

  std::optional<Eigen::Isometry3d> given_, mapped_;  // of the last scan
  double stamp_s_ = 0;
  std::array<Eigen::Vector3f, 64> readings_{};  // of it, spread over it
  std::size_t points_ = 0;
  bool left_identity_ = false;
  std::vector<Move> recent_;  // the last five
  std::size_t moves_ = 0;
  Spread<float> lengths_m_{1000}, steps_m_{1000};  // for medians, however long the recording
  std::optional<Step> longest_;                    // that stands out
};

}  // namespace octosurf::judgement
