#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

/// Consecutive scans at which the recording's poses deviate from the map built before.
struct LoopClosure {
  std::string first, last;  ///< names of scans
  double farthest_m = 0;    ///< largest change of the correction, at the sensor
};

/// Distinguishes loop closures on a deformed map from single pose outliers.
///
/// A scan is a closure if its correction differs from the last lasting one by more than a voxel at the
/// sensor, and the next scan confirms it: its correction is nearer to this scan's than to the former. After a
/// single outlier the correction returns to the former. The last scan has no successor, so it is never a
/// closure.
class LoopClosures {
 public:
  void add(const Scan& scan, const Alignment& alignment, double resolution) {
    if (alignment.outcome == AlignmentOutcome::rejected) return;  // was not inserted
    ++scans_;
    const Eigen::Isometry3d correction = alignment.T_map_sensor * scan.T_map_sensor.inverse();
    const auto from_here = [&](const Eigen::Isometry3d& other) {
      const Eigen::Vector3d place = scan.T_map_sensor.translation();
      return (correction * place - other * place).norm();
    };
    if (step_ && from_here(step_->correction) <= from_here(lasting_)) {
      note(*step_);
      lasting_ = step_->correction;
    }
    step_.reset();
    const double distance = from_here(lasting_);
    if (distance > resolution)
      step_ = Step{scan.name, distance, correction};
    else
      lasting_ = correction;
  }
  const std::vector<LoopClosure>& all() const { return all_; }

 private:
  struct Step {
    std::string scan;
    double distance_m = 0;
    Eigen::Isometry3d correction;  ///< in the map frame
  };
  void note(const Step& step) {
    const std::uint64_t at = scans_ - 1;
    if (all_.empty() || end_of_last_ + 1 < at) all_.push_back({step.scan, step.scan, 0});
    all_.back().last = step.scan;
    all_.back().farthest_m = std::max(all_.back().farthest_m, step.distance_m);
    end_of_last_ = at;
  }

  Eigen::Isometry3d lasting_ = Eigen::Isometry3d::Identity();  ///< last correction that was not an outlier
  std::optional<Step> step_;                                   ///< of the last scan
  std::uint64_t scans_ = 0, end_of_last_ = 0;
  std::vector<LoopClosure> all_;
};

}  // namespace octosurf
