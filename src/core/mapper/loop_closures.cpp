#include "mapper/loop_closures.hpp"

#include <algorithm>

namespace octosurf::mapper {

void LoopClosures::add(const Scan& scan, const Alignment& alignment, double resolution) {
  if (alignment.outcome == AlignmentOutcome::set_aside) return;  // was not inserted
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

void LoopClosures::note(const Step& step) {
  const std::uint64_t at = scans_ - 1;
  if (all_.empty() || end_of_last_ + 1 < at) all_.push_back({step.scan, step.scan, 0});
  all_.back().last = step.scan;
  all_.back().farthest_m = std::max(all_.back().farthest_m, step.distance_m);
  end_of_last_ = at;
}

}  // namespace octosurf::mapper
