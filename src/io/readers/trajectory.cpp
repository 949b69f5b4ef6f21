#include "io/readers/trajectory.hpp"

#include "geometry/directions.hpp"
#include "io/readers/pose_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::int64_t nearest_within_ns = 20000000;  // TUM's associate.py
constexpr std::int64_t stamp_rounding_ns = 1000;      // seconds since 1970 as double are exact to 240 ns

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

Trajectory::Place Trajectory::place_of(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady) const {
  if (samples_.empty()) return {nullptr, nullptr, "there is none"};
  const auto found = std::ranges::lower_bound(samples_, stamp_ns, {}, &Sample::stamp_ns);
  const Sample* const after = found == samples_.end() ? nullptr : &*found;
  const Sample* const before = found == samples_.begin() ? nullptr : &*std::prev(found);
  if (after != nullptr && after->stamp_ns == stamp_ns) return {after, after, {}};
  if (steady && !changes_ && samples_.size() > 1) return {samples_.data(), samples_.data(), {}};
  if (before != nullptr && after != nullptr) {
    if (is_same(*before, *after)) return {before, before, {}};
    if (ns_between(before->stamp_ns, after->stamp_ns) <= gap_ns + stamp_rounding_ns)
      return {before, after, {}};
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

}  // namespace octosurf::io
