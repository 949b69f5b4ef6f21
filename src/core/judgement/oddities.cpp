#include "judgement/oddities.hpp"

#include "geometry/median.hpp"

#include <algorithm>
#include <cstring>

namespace octosurf::judgement {
namespace {

/// A step stands out if it is five times as long as the two before it and the two after it: who starts, stops
/// or turns does so over several scans.
constexpr double far_longer = 5;
constexpr std::size_t beside = 2;

bool equal(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) { return a.matrix() == b.matrix(); }

/// m: from one pose to another, and what turns move at `lever_m`.
double length_of(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, double lever_m) {
  const Eigen::Isometry3d step = from.inverse() * to;
  return step.translation().norm() + lever_m * Eigen::AngleAxisd(step.linear()).angle();
}

}  // namespace

std::optional<Oddities::Kind> Oddities::add(const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                                            double lever_m) {
  const Eigen::Isometry3d& given = scan.T_map_sensor;
  std::array<Eigen::Vector3f, 64> readings{};
  for (std::size_t k = 0; k < readings.size() && !scan.points.empty(); ++k)
    readings[k] = scan.points[k * scan.points.size() / readings.size()];
  // By their bytes, as what is no reading may be NaN.
  const bool read_before = given_ && points_ > 0 && scan.points.size() == points_ &&
                           std::memcmp(readings.data(), readings_.data(), sizeof(readings)) == 0;
  const bool here_before = given_ && equal(*given_, given);
  const bool is_identity = equal(given, Eigen::Isometry3d::Identity());
  if (given_) {
    if (steps_m_.wants())
      steps_m_.take(static_cast<float>((given_->translation() - given.translation()).norm()));
    // Alignment may move the map's poses to close a loop, or the given ones may jump and be mended: neither
    // is a step of both.
    note_move({std::min(length_of(*given_, given, lever_m), length_of(*mapped_, T_map_sensor, lever_m)),
               scan.stamp_s - stamp_s_, scan.name});
  }
  std::optional<Kind> kind;
  if (here_before && !read_before) kind = same_pose;
  if (is_identity && left_identity_) kind = identity;
  if (read_before && !here_before) kind = same_readings;
  left_identity_ |= !is_identity;
  given_ = given;
  mapped_ = T_map_sensor;
  stamp_s_ = scan.stamp_s;
  readings_ = readings;
  points_ = scan.points.size();
  return kind;
}

void Oddities::note_move(Move move) {
  ++moves_;
  if (lengths_m_.wants()) lengths_m_.take(static_cast<float>(move.length_m));
  recent_.push_back(std::move(move));
  if (recent_.size() < 2 * beside + 1) return;
  const Move middle = recent_[beside];
  double longest = 0, slowest = 0;
  for (std::size_t k = 0; k < recent_.size(); ++k)
    if (k != beside) {
      longest = std::max(longest, recent_[k].length_m);
      slowest = std::max(slowest, recent_[k].seconds);
    }
  // Where scans are missing the step may be as much longer.
  const double missing = slowest > 0 ? std::max(1.0, middle.seconds / slowest) : 1;
  if (middle.length_m > std::max(far_longer * missing * longest, longest_ ? longest_->length_m : 0))
    longest_ = Step{moves_ - beside, middle.name, middle.length_m};
  recent_.erase(recent_.begin());
}

std::optional<Oddities::Step> Oddities::longest_step(double least_m) const {
  if (!longest_) return {};
  std::vector<float> lengths = lengths_m_.kept();
  const double usual = far_longer * static_cast<double>(geometry::median_of(lengths));
  return longest_->length_m > std::max(least_m, usual) ? longest_ : std::nullopt;
}

double Oddities::median_step_m() const {
  std::vector<float> steps = steps_m_.kept();
  return steps.empty() ? 0 : static_cast<double>(geometry::median_of(steps));
}

}  // namespace octosurf::judgement
