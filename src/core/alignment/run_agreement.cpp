#include "alignment/run_agreement.hpp"

#include "geometry/median.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::alignment {
namespace {

/// A step from one scan to the next is a jump if it exceeds the median by this many standard deviations
/// (estimated from the median deviation, for a normal distribution) and is twice the median.
constexpr double jump_deviations = 6;
/// m and rad: smaller steps are jitter of poses that stand still.
constexpr double least_jump_m = 0.05, least_jump_rad = 0.02;
/// Shares of the scans after the first contradiction: of those that contradict, and of those at which
/// agreement turns. Of two tracks half do, and often their views do not meet; after a jump few do.
constexpr double scans_of_two_tracks = 0.3, turns_of_two_tracks = 0.25;

double median_of(std::vector<double> values, double none) {
  return values.empty() ? none : geometry::median_of(values);
}

/// A larger step is a jump.
double largest_step(const std::vector<double>& steps, double least) {
  const double usual = median_of(steps, 0);
  std::vector<double> off;
  for (const double one : steps) off.push_back(std::fabs(one - usual));
  return std::max(
      least, usual + std::max(usual, jump_deviations * geometry::deviation_per_median * median_of(off, 0)));
}

}  // namespace

void RunAgreement::add(const Scan& scan, const Agreement& agreement, const Alignment& alignment) {
  double step_m = 0, step_rad = 0;
  if (last_) {
    const Eigen::Isometry3d step = last_->inverse() * scan.T_map_sensor;
    steps_m_.push_back(step_m = step.translation().norm());
    steps_rad_.push_back(step_rad = Eigen::AngleAxisd(step.linear()).angle());
  }
  const std::size_t index = last_ ? steps_m_.size() : 0;
  last_ = scan.T_map_sensor;
  const AlignmentOutcome outcome = alignment.outcome;
  const bool recovered = outcome == AlignmentOutcome::recovered;
  const bool relocated = recovered || outcome == AlignmentOutcome::rejected;
  Judged judged{index, scan.stamp_s, agreement.share(), step_m, step_rad, relocated, 0, 0};
  if (recovered) {
    const Eigen::Isometry3d moved = alignment.T_map_sensor * (correction_ * scan.T_map_sensor).inverse();
    const Eigen::Vector3d place = alignment.T_map_sensor.translation();
    judged.moved_m = (moved * place - place).norm();
    judged.moved_rad = Eigen::AngleAxisd(moved.linear()).angle();
  }
  if (!relocated && outcome != AlignmentOutcome::off)
    correction_ = alignment.T_map_sensor * scan.T_map_sensor.inverse();
  if (agreement.compared() >= fewest_compared || relocated) judged_.push_back(judged);
}

double RunAgreement::median() const {
  std::vector<double> shares;
  for (const Judged& scan : judged_) shares.push_back(scan.share);
  return median_of(std::move(shares), 1);
}

double RunAgreement::least() const {
  double least = 1;
  for (const Judged& scan : judged_) least = std::min(least, scan.share);
  return least;
}

std::optional<RunAgreement::Contradiction> RunAgreement::contradiction() const {
  const double enough = much_less * std::max(usual, median());
  const double most_m = largest_step(steps_m_, least_jump_m),
               most_rad = largest_step(steps_rad_, least_jump_rad);
  Contradiction found;
  std::size_t since = 0, turns = 0;
  bool before = false;
  for (const Judged& scan : judged_) {
    const double jump_m = scan.step_m > most_m ? scan.step_m : 0,
                 jump_rad = scan.step_rad > most_rad ? scan.step_rad : 0;
    const bool contradicts = scan.share < enough || (scan.relocated && jump_m + jump_rad > 0);
    if (contradicts && found.scans++ == 0) {
      found.first = scan.scan;
      found.stamp_s = scan.stamp_s;
      found.jump_m = jump_m;
      found.jump_rad = jump_rad;
    }
    if (found.scans == 0) continue;
    constexpr std::size_t soon = 10;  // scans, in which known surfaces come into view
    if (scan.moved_m > 0 && scan.scan < found.first + soon) {
      found.jump_m = scan.moved_m;
      found.jump_rad = scan.moved_rad;
    }
    ++since;
    turns += contradicts != before;
    before = contradicts;
    if (contradicts) found.share += scan.share;
    found.moved += contradicts && scan.relocated;
  }
  if (found.scans == 0) return {};
  found.share /= static_cast<double>(found.scans);
  found.alternates = turns > 2 &&
                     static_cast<double>(found.scans) >= scans_of_two_tracks * static_cast<double>(since) &&
                     static_cast<double>(turns) >= turns_of_two_tracks * static_cast<double>(since);
  return found;
}

}  // namespace octosurf::alignment
