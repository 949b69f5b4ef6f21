#include "io/readers/trajectory.hpp"

#include "geometry/degrees.hpp"
#include "geometry/directions.hpp"
#include "geometry/median.hpp"
#include "io/readers/pose_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::int64_t nearest_within_ns = 20000000;  // TUM's associate.py
constexpr std::int64_t stamp_rounding_ns = 1000;      // seconds since 1970 as double are exact to 240 ns

// Faster than any carried sensor: at 10 Hz 20 cm and 17° a step, at 1 Hz 2 m.
constexpr double least_jump_m_s = 2, least_jump_rad_s = 3;
// Frequent corrections of odometry's drift are smaller; alignment handles them.
constexpr double least_jump_m = 0.1, least_jump_rad = 0.1;
// Speeds lie up to 7 spreads (1.4826 times the median of how far they are from the median) above the median
// in correct recordings, hand-held and on robots; odometry that restarts 0.7 m away is at 1000.
constexpr double jump_spreads = 20;
// A robot that stood and runs is fast in several steps, up to 3.3 times as in the second fastest of those
// around. One bad sample makes two fast steps.
constexpr std::size_t steps_around = 4, fast_beside = 1;
constexpr double jump_beside = 5;
constexpr std::size_t least_steps = 10;  // to compare with

/// pose_from()'s limit: a quaternion of single precision is off by 1e-7, one that is off by 1 % is damaged.
bool is_pose(const Trajectory::Sample& sample) {
  return sample.translation.allFinite() && std::abs(sample.rotation.norm() - 1) <= 1e-2;
}

std::string seconds_text(std::int64_t ns) { return formatted("%.3f s", static_cast<double>(ns) / 1e9); }

/// b − a, or the largest number if that overflows; a ≤ b.
std::int64_t ns_between(std::int64_t a, std::int64_t b) {
  const auto apart = static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a);
  return static_cast<std::int64_t>(std::min<std::uint64_t>(apart, std::numeric_limits<std::int64_t>::max()));
}

/// Up to what float and a product of rotations may round.
bool is_same(const Trajectory::Sample& a, const Trajectory::Sample& b) {
  constexpr double rounding = 1e-6;  // m and rad
  const Eigen::Vector4d q = a.rotation.coeffs(), p = b.rotation.coeffs();
  return (a.translation - b.translation).norm() <= rounding &&
         2 * std::min((q - p).norm(), (q + p).norm()) <= rounding;  // half of the angle
}

/// Marks the steps that are far faster than the rest. A step shorter in time than usual counts as a usual
/// one: after a late message the next step would seem fast.
void mark_fast(const std::vector<double>& lengths, const std::vector<double>& times_s, double least_length,
               double least_speed, std::vector<bool>& fast) {
  std::vector<double> speeds(lengths.size());
  for (std::size_t i = 0; i < lengths.size(); ++i) speeds[i] = lengths[i] / times_s[i];
  std::vector<double> sorted = speeds;
  const double usual = geometry::median_of(sorted);
  for (double& speed : sorted) speed = std::abs(speed - usual);
  const double spread = geometry::deviation_per_median * geometry::median_of(sorted);
  const double most = std::max(least_speed, usual + jump_spreads * spread);
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    if (!(lengths[i] > least_length && speeds[i] > most)) continue;
    std::vector<double> around;
    for (std::size_t j = i - std::min(i, steps_around); j < std::min(i + steps_around + 1, speeds.size());
         ++j)
      if (j != i) around.push_back(speeds[j]);
    std::ranges::sort(around, std::greater{});
    fast[i] = fast[i] || speeds[i] > jump_beside * around[fast_beside];
  }
}

}  // namespace

std::int64_t to_ns(double seconds) {
  constexpr double most = 9.2e18;
  return std::llround(std::clamp(seconds * 1e9, -most, most));
}

std::string stamp_text(std::int64_t stamp_ns) {
  return formatted("%lld.%09lld", static_cast<long long>(stamp_ns / 1000000000),
                   static_cast<long long>(std::abs(stamp_ns % 1000000000)));
}

Trajectory::Sample Trajectory::sample(double stamp_s, const Eigen::Isometry3d& T) {
  return {to_ns(stamp_s), T.translation(), Eigen::Quaternion<double, Eigen::DontAlign>(T.linear())};
}

Eigen::Isometry3d transform_of(const Trajectory::Sample& sample) try {
  return rigid(pose_from(sample.translation, Eigen::Quaterniond(sample.rotation)),
               "pose at " + seconds_text(sample.stamp_ns));
} catch (const Error& error) {  // the caller adds the scan
  throw std::runtime_error(error.what());
}

void Trajectory::finish() {
  if (std::ranges::any_of(samples_, is_pose))
    left_out_ += std::erase_if(samples_, [](const Sample& sample) { return !is_pose(sample); });
  std::ranges::stable_sort(samples_, {}, &Sample::stamp_ns);
  const auto differs = [&](const Sample& sample) { return !is_same(sample, samples_.front()); };
  changes_ = changes_ || std::ranges::any_of(samples_, differs);
  // Of equal times keep the last: unique() over the reversed sequence keeps its first.
  const auto kept = std::unique(samples_.rbegin(), samples_.rend(),
                                [](const Sample& a, const Sample& b) { return a.stamp_ns == b.stamp_ns; });
  samples_.erase(samples_.begin(), kept.base());
}

void Trajectory::forget_before(std::int64_t stamp_ns) {
  samples_.erase(samples_.begin(), std::ranges::lower_bound(samples_, stamp_ns, {}, &Sample::stamp_ns));
}

void Trajectory::find_jumps() {
  jumps_.clear();
  if (!changes_ || samples_.size() <= least_steps) return;
  std::vector<double> lengths_m, angles_rad, times_s;
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    const Sample &a = samples_[i - 1], &b = samples_[i];
    lengths_m.push_back((b.translation - a.translation).norm());
    angles_rad.push_back(a.rotation.normalized().angularDistance(b.rotation.normalized()));
    times_s.push_back(static_cast<double>(ns_between(a.stamp_ns, b.stamp_ns)) / 1e9);
  }
  std::vector<double> sorted = times_s;
  const double usual_s = geometry::median_of(sorted);
  for (double& time : times_s) time = std::max(time, usual_s);
  std::vector<bool> fast(times_s.size());
  mark_fast(lengths_m, times_s, least_jump_m, least_jump_m_s, fast);
  mark_fast(angles_rad, times_s, least_jump_rad, least_jump_rad_s, fast);
  for (std::size_t i = 0; i < fast.size(); ++i)
    if (fast[i])
      jumps_.push_back({samples_[i].stamp_ns, samples_[i + 1].stamp_ns, lengths_m[i], angles_rad[i]});
}

bool Trajectory::leads_on(const Sample& a, const Sample& b, std::int64_t gap_ns) const {
  return ns_between(a.stamp_ns, b.stamp_ns) <= gap_ns + stamp_rounding_ns &&
         std::ranges::none_of(jumps_, [&](const Jump& jump) {
           return jump.before_ns < b.stamp_ns && a.stamp_ns < jump.after_ns;
         });
}

Trajectory::Place Trajectory::place_of(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady) const {
  if (samples_.empty()) return {nullptr, nullptr, "there is none"};
  const auto found = std::ranges::lower_bound(samples_, stamp_ns, {}, &Sample::stamp_ns);
  const Sample* const after = found == samples_.end() ? nullptr : &*found;
  const Sample* const before = found == samples_.begin() ? nullptr : &*std::prev(found);
  if (after != nullptr && after->stamp_ns == stamp_ns) return {after, after, {}};
  if (steady && !changes_ && samples_.size() > 1) return {samples_.data(), samples_.data(), {}};
  if (std::ranges::any_of(jumps_, [&](const Jump& jump) { return jump.holds(stamp_ns); }))
    return {nullptr, nullptr, "they jump there"};
  if (before != nullptr && after != nullptr) {
    if (is_same(*before, *after)) return {before, before, {}};
    if (leads_on(*before, *after, gap_ns)) return {before, after, {}};
  }
  constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();
  const std::int64_t since = before == nullptr ? never : ns_between(before->stamp_ns, stamp_ns);
  const std::int64_t until = after == nullptr ? never : ns_between(stamp_ns, after->stamp_ns);
  const Sample* const nearest = since < until ? before : after;
  if (nearest != nullptr && std::min(since, until) <= std::min(nearest_within_ns, gap_ns))
    return {nearest, nearest, {}};
  if (before == nullptr) return {nullptr, nullptr, "the first is " + seconds_text(until) + " later"};
  if (after == nullptr) return {nullptr, nullptr, "the last is " + seconds_text(since) + " earlier"};
  const std::int64_t apart = ns_between(before->stamp_ns, after->stamp_ns);
  return {nullptr, nullptr, "its neighbours in time are " + seconds_text(apart) + " apart"};
}

std::string Trajectory::gap_at(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady) const {
  return place_of(stamp_ns, gap_ns, steady).gap;
}

std::optional<std::int64_t> Trajectory::step_at(std::int64_t stamp_ns, std::int64_t gap_ns) const {
  const Place place = place_of(stamp_ns, gap_ns, false);
  if (place.before == place.after) return {};
  return ns_between(place.before->stamp_ns, place.after->stamp_ns);
}

Eigen::Isometry3d Trajectory::at(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady) const {
  const Place place = place_of(stamp_ns, gap_ns, steady);
  if (!place.gap.empty()) throw NoPose(place.gap);
  const Sample &a = *place.before, &b = *place.after;
  if (&a == &b) return transform_of(a);
  return geometry::pose_between(
      transform_of(a), transform_of(b),
      static_cast<double>(stamp_ns - a.stamp_ns) / static_cast<double>(ns_between(a.stamp_ns, b.stamp_ns)));
}

Eigen::Isometry3d Trajectory::held_at(std::int64_t stamp_ns) const {
  const auto after = std::ranges::upper_bound(samples_, stamp_ns, {}, &Sample::stamp_ns);
  return transform_of(after == samples_.begin() ? *after : *std::prev(after));
}

std::span<const Trajectory::Sample> Trajectory::around(std::int64_t stamp_ns, std::int64_t gap_ns,
                                                       std::size_t count) const {
  const auto middle = static_cast<std::size_t>(
      std::ranges::lower_bound(samples_, stamp_ns, {}, &Sample::stamp_ns) - samples_.begin());
  std::size_t begin = middle, end = middle;
  const auto leads = [&](std::size_t a) { return leads_on(samples_[a], samples_[a + 1], gap_ns); };
  while (end < samples_.size() && end < middle + count && (end == begin || leads(end - 1))) ++end;
  while (begin > 0 && begin + count > middle && (begin == end || leads(begin - 1))) --begin;
  return std::span(samples_).subspan(begin, end - begin);
}

std::string text_of_jumps(const Trajectory& poses) {
  const std::vector<Trajectory::Jump>& jumps = poses.jumps();
  if (jumps.empty()) return {};
  const Trajectory::Jump& first = jumps.front();
  return "poses jump " + (jumps.size() == 1 ? "" : count_of(jumps.size(), "time") + ", first ") +
         formatted("by %.2f m and %.1f degrees %.2f s after the first", first.distance_m,
                   first.angle_rad * deg_per_rad,
                   static_cast<double>(ns_between(poses.samples().front().stamp_ns, first.after_ns)) / 1e9) +
         ": odometry that began anew, or a correction; scans between are left out";
}

}  // namespace octosurf::io
