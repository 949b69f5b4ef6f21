#pragma once

#include <boost/circular_buffer.hpp>
#include <cstddef>
#include <optional>

namespace octosurf {

/// What waits for the mapper while scans arrive at their time stamps.
struct Waiting {
  double waited_s = 0;    ///< the oldest scan that waits
  double cost_s = 0;      ///< of a scan lately
  double interval_s = 0;  ///< between arrivals lately
};

/// One by one, the scans that wait would keep the newest of them waiting for longer than the arrival of as
/// many as `together` takes.
///
/// Scans w / T wait, for a wait w of the oldest and an interval T of arrivals; at a cost c each, the newest
/// comes out w/T · c later. If c < T on average, bursts pass: the queue shortens by 1 − c/T of what is mapped
/// and the wait stays short. If not, it grows without end and passes any limit. The limit is where joining
/// costs no more than it gains: surfaces on the first of K scans that are joined are found with the last of
/// them, which arrives K · T later.
bool falls_behind(const Waiting& waiting, std::size_t together);

/// Whether the mapper has fallen behind for good, so that scans that wait are better mapped together: from
/// when falls_behind() until nothing waits any more.
class Backlog {
 public:
  /// `together`: scans at most; 1: never.
  explicit Backlog(std::size_t together);

  /// The next scan to be mapped has this time stamp, and has been there for so long; not above 0: the mapper
  /// waits for it.
  void next(double stamp_s, double waited_s);
  /// True after next(): others that wait should be mapped with it.
  bool join() const { return behind_; }
  /// Another one, which is mapped with it.
  void joined(double stamp_s);
  /// They are mapped.
  void mapped(double took_s);

 private:
  void take(double stamp_s);

  std::size_t together_;
  boost::circular_buffer<double> costs_s_, intervals_s_;  // of the last scans, as many as may be joined
  std::optional<double> last_stamp_s_;
  std::size_t taken_ = 0;  // since the last mapped()
  bool behind_ = false;
};

}  // namespace octosurf
