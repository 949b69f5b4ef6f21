#include "io/readers/scan_motion.hpp"

#include "geometry/median.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>

namespace octosurf::io {
namespace {

constexpr double longest_sweep_s = 10;   // of a scanner that a motor tilts; lidars take 0.05 to 0.2 s
constexpr double usual_sweep_s = 0.1;    // of a single scan
constexpr std::size_t most_samples = 5;  // one in the middle of a recording is whole, whatever its ends are

double median_gap(const std::vector<double>& stamps_s) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < stamps_s.size(); ++i)
    if (stamps_s[i] > stamps_s[i - 1]) gaps.push_back(stamps_s[i] - stamps_s[i - 1]);
  return gaps.empty() ? usual_sweep_s : geometry::median_of(gaps);
}

std::string centimetres(double metres) { return formatted("%.*f cm", metres < 0.095 ? 1 : 0, 100 * metres); }

/// Keeps enough points to measure how far they move.
void thin(RawScan& raw) {
  constexpr std::size_t most_kept = 8192;
  const std::size_t step = 1 + raw.scan.points.size() / most_kept;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < raw.scan.points.size(); i += step, ++kept) {
    raw.scan.points[kept] = raw.scan.points[i];
    if (!raw.times.values.empty()) raw.times.values[kept] = raw.times.values[i];
  }
  raw.scan.points.resize(kept);
  raw.times.values.resize(std::min(kept, raw.times.values.size()));
}

/// The farthest that a reading moves from one to the other.
double farthest_move(const Scan& a, const Scan& b) {
  float farthest = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i)
    if (const float moved = (a.points[i] - b.points[i]).norm(); std::isfinite(moved))
      farthest = std::max(farthest, moved);
  return static_cast<double>(farthest);
}

}  // namespace

bool is_time_field(std::string_view name) {
  constexpr std::array<std::string_view, 11> names{
      "t",           "time",      "times", "timestamp", "time_stamp",       "offset_time",
      "time_offset", "offset_ns", "stamp", "ts",        "point_time_offset"};
  return std::ranges::find(names, name) != names.end();
}

std::optional<TimedCloud> timed_cloud(double stamp_s, const std::vector<Eigen::Vector3f>& points,
                                      const PointTimes& times) {
  TimedCloud cloud{stamp_s - times.later_s, std::numeric_limits<double>::infinity(),
                   -std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < times.values.size(); ++i) {
    if (!points[i].allFinite() || !std::isfinite(times.values[i])) continue;
    cloud.first = std::min(cloud.first, times.values[i]);
    cloud.last = std::max(cloud.last, times.values[i]);
  }
  return cloud.first <= cloud.last ? std::optional(cloud) : std::nullopt;
}

std::optional<PointClock> clock_of(std::span<const TimedCloud> clouds, double period_s) {
  double span = 0;
  for (const TimedCloud& cloud : clouds) span = std::max(span, cloud.last - cloud.first);
  const double longest_s = std::min(2 * period_s, longest_sweep_s);
  for (const double unit_s : {1.0, 1e-3, 1e-6, 1e-9}) {
    if (span == 0 || span * unit_s > longest_s) continue;
    const auto all_near = [&](const auto& zero_s) {
      return std::ranges::all_of(clouds, [&](const TimedCloud& cloud) {
        return std::abs(cloud.first * unit_s - zero_s(cloud)) <= longest_s;
      });
    };
    PointClock clock{unit_s, PointClock::Zero::other_clock, longest_s};
    if (all_near([](const TimedCloud&) { return 0.0; }))
      clock.zero = PointClock::Zero::stamp;
    else if (all_near([](const TimedCloud& cloud) { return cloud.stamp_s; }))
      clock.zero = PointClock::Zero::epoch;
    return clock;
  }
  return std::nullopt;
}

std::vector<float> PointClock::after_stamp(double stamp_s, const std::vector<Eigen::Vector3f>& points,
                                           const PointTimes& times) const {
  const auto cloud = timed_cloud(stamp_s, points, times);
  double begin = 0;  // the stamp in the field's unit
  if (zero == Zero::epoch) begin = (stamp_s - times.later_s) / unit_s;
  if (zero == Zero::other_clock && cloud) begin = cloud->first;
  std::vector<float> after;
  after.reserve(times.values.size());
  for (const double value : times.values) {
    const double s = (value - begin) * unit_s;
    after.push_back(std::abs(s) <= 2 * longest_s ? static_cast<float>(s)
                                                 : std::numeric_limits<float>::quiet_NaN());
  }
  return after;
}

std::string PointClock::text() const {
  const std::string unit = unit_s == 1 ? "s" : unit_s == 1e-3 ? "ms" : unit_s == 1e-6 ? "µs" : "ns";
  if (zero == Zero::stamp) return unit + " after the stamp";
  if (zero == Zero::epoch) return unit + " on the stamps' clock";
  return unit + " on another clock than the stamps': the first is taken for the stamp's";
}

ScanMotion::ScanMotion(Recording recording)
    : recording_(std::move(recording)), period_s_(median_gap(recording_.stamps_s)) {
  for (const double stamp_s : recording_.stamps_s) {
    try {
      poses_.add(Trajectory::sample(stamp_s, recording_.pose_at(stamp_s)));
    } catch (const std::runtime_error&) {  // reported when that scan is read
    }
  }
  poses_.finish();
  std::vector<TimedCloud> timed;
  std::vector<RawScan> samples = read_samples();
  for (const RawScan& raw : samples) {
    if (const auto cloud = timed_cloud(raw.scan.stamp_s, raw.scan.points, raw.times)) timed.push_back(*cloud);
    field_ = raw.times.field;
  }
  clock_ = clock_of(timed, period_s_);
  if (clock_) note_undone(samples);
}

std::vector<RawScan> ScanMotion::read_samples() const {
  std::vector<RawScan> samples;
  const std::size_t scans = recording_.stamps_s.size(), count = std::min(scans, most_samples);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t scan = (2 * i + 1) * scans / (2 * count);
    try {
      RawScan raw = recording_.read(scan);
      raw.scan.stamp_s = recording_.stamps_s[scan];
      raw.scan.T_map_sensor = recording_.pose_at(raw.scan.stamp_s);
      thin(raw);
      samples.push_back(std::move(raw));
      if (samples.back().times.values.empty()) break;  // nothing to undo
    } catch (const std::runtime_error&) {              // a bad scan: reported when its turn comes
    }
  }
  return samples;
}

std::optional<Scan> ScanMotion::undone(const Scan& scan) const {
  try {
    return deskew(scan, recording_.pose_at);
  } catch (const std::runtime_error&) {
  }
  const std::int64_t gap_ns = std::min(to_ns(1.5 * period_s_), largest_gap_in_bags_ns);
  try {  // poses as often as scans: between these
    return deskew(scan, [&](double stamp_s) { return poses_.at(to_ns(stamp_s), gap_ns); });
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

Scan ScanMotion::operator()(RawScan raw) const {
  if (!clock_ || raw.times.values.empty()) return std::move(raw.scan);
  raw.scan.times_s = clock_->after_stamp(raw.scan.stamp_s, raw.scan.points, raw.times);
  std::optional<Scan> result = undone(raw.scan);
  return result ? *std::move(result) : std::move(raw.scan);
}

void ScanMotion::note_undone(std::vector<RawScan>& samples) {
  const std::string times = "times: field " + field_ + " (" + clock_->text() + "); motion within a scan is ";
  double farthest = 0;
  std::size_t left = 0;
  for (RawScan& raw : samples) {
    raw.scan.times_s = clock_->after_stamp(raw.scan.stamp_s, raw.scan.points, raw.times);
    if (const auto moved = undone(raw.scan))
      farthest = std::max(farthest, farthest_move(raw.scan, *moved));
    else
      ++left;
  }
  if (left < samples.size())
    notes_.push_back(times + "undone, which moves readings by up to " + centimetres(farthest));
  if (left > 0)
    notes_.push_back(times + "not undone in " + std::to_string(left) + " of " +
                     std::to_string(samples.size()) +
                     " that were looked at, for lack of poses: record them at least as often as scans");
}

}  // namespace octosurf::io
