#pragma once

#include "io/readers/trajectory.hpp"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/deskew.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::io {

/// When a cloud's points were taken, in the unit and from the zero of its field.
struct PointTimes {
  std::string field;           ///< empty: it has none
  std::vector<double> values;  ///< one for each point
  double later_s = 0;          ///< a scan's stamp_s is as much later than its stamp by their clock
};

/// True for names that drivers give to a point's time.
bool is_time_field(std::string_view name);

/// A cloud by which the times' unit is recognised.
struct TimedCloud {
  double stamp_s = 0;
  double first = 0, last = 0;  ///< of the points that are readings
};
/// Of the finite points; empty: none of them has a finite time.
std::optional<TimedCloud> timed_cloud(double stamp_s, const std::vector<Eigen::Vector3f>& points,
                                      const PointTimes& times);

/// What a field's times mean.
struct PointClock {
  double unit_s = 1;
  enum class Zero {
    stamp,       ///< the cloud's time stamp
    epoch,       ///< that of the time stamps
    other_clock  ///< of another clock; the first point is assumed to be at the time stamp
  } zero = Zero::stamp;
  double longest_s = 0;  ///< largest valid distance from the time stamp

  /// s after the stamp; NaN for invalid times.
  std::vector<float> after_stamp(double stamp_s, const std::vector<Eigen::Vector3f>& points,
                                 const PointTimes& times) const;
  std::string text() const;
};
/// By the largest unit of s to ns in which a cloud took at most twice the `period_s`, and 10 s. Empty: none.
std::optional<PointClock> clock_of(std::span<const TimedCloud> clouds, double period_s);

/// A scan as its file or message has it.
struct RawScan {
  Scan scan;  ///< its pose is that of the same file, if there is one
  PointTimes times{};
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< m, subtracted from the points (cloud_file.hpp)
  int width = 0, height = 0;                        ///< of a file's image
  bool posed = false;                               ///< the recording says where it was seen from

  /// The points of a survey lie in the map's frame, too far from its origin for floats.
  bool shifted() const { return !shift.isZero(0); }
  bool from_nowhere() const { return shifted() && !posed; }
};

/// Undoes the motion within the scans of a recording's one sensor.
class ScanMotion {
 public:
  struct Recording {
    std::vector<double> stamps_s;  ///< of its scans, ascending
    PoseAtTime pose_at;            ///< throws std::runtime_error where there is none
    std::function<RawScan(std::size_t scan)> read;
  };
  /// Reads up to five scans, to recognise the unit of their times.
  explicit ScanMotion(Recording recording);

  /// The scan with its motion undone; or with `times_s` where that cannot be.
  Scan operator()(RawScan raw) const;

  /// Whether the motion is undone; empty: its points have no times.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  /// Up to five good scans, posed and thinned; one if it has no times.
  std::vector<RawScan> read_samples() const;
  void note_undone(std::vector<RawScan>& samples);
  /// Empty: poses do not reach over its readings' times.
  std::optional<Scan> undone(const Scan& scan) const;

  Recording recording_;
  double period_s_ = 0;
  Trajectory poses_;  // at the scans' stamps
  std::optional<PointClock> clock_;
  std::string field_;  // of the times
  std::vector<std::string> notes_;
};

}  // namespace octosurf::io
