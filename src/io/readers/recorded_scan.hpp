#pragma once

#include "io/readers/reading_rules.hpp"
#include "io/readers/scan_list.hpp"
#include "io/readers/scan_motion.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/scan_source.hpp>

// The steps from a listed scan to one in the map's frame, in their order.
namespace octosurf::io {

/// m, rounded: near the first good scan, if that is farther from 0 than options.origin_beyond_m; else empty.
std::optional<Eigen::Vector3d> far_origin(const ScanList& list, const ScanSourceOptions& options);

/// Points as their file or message has them, in metres by options.depth_scale, with the pose that the
/// recording has for them. Throws Error(data) if the scan or its pose is bad.
RawScan read_posed(const ListedRecording& recording, const ListedScan& listed,
                   const ScanSourceOptions& options);

/// Throws Error(data) if it is an image of another size than `before`, which the first one sets.
void require_size_as_before(const RawScan& raw, std::optional<std::pair<int, int>>& before);

/// Readings in the boxes become NaN; returns their number. Throws Error(usage) where a box names a frame
/// without tf.
std::size_t erase_own(Scan& scan, const ListedRecording& recording, const ListedScan& listed,
                      const std::vector<SelfBox>& boxes);

using Motions = std::map<std::uint32_t, ScanMotion>;  ///< by sensor
/// Of the sensors whose points may have times, where their poses are known then. Keeps a reference to the
/// recording.
Motions motions_of(const ListedRecording& recording, const ScanSourceOptions& options,
                   std::vector<std::string>& notes);

/// Seen from a place of its frame, a scan without a pose.
void set_viewpoint(RawScan& raw, const Eigen::Vector3d& at);

/// Gives the points their place in the sensor's frame, and subtracts the origin from the pose; a survey's
/// points, which have no sensor's place, stay in the map's frame. Throws Error(data) if points and pose are
/// too far apart for that.
Scan place(RawScan raw, const Eigen::Vector3d& origin);

/// Time stamps of scans one after the other, s.
class StampSequence {
 public:
  /// Stamps of the scans that follow are used unless they would decrease.
  void begin_recording() { shift_s_.reset(); }
  /// Without a stamp of its own a scan follows at the rate.
  double next(const std::optional<double>& stamp_s, double rate_hz);

 private:
  std::optional<double> shift_s_;  // of this recording's time stamps
  double since_s_ = 0, rate_ = 0;  // rate 0: no scan yet
  std::size_t steps_ = 0;          // since since_s_; a count, so that rounding does not accumulate
};

}  // namespace octosurf::io
