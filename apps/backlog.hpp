#pragma once

#include <boost/circular_buffer.hpp>
#include <cstddef>
#include <optional>

namespace octosurf {

/// State of the queue while scans arrive at their time stamps.
struct Waiting {
  double waited_s = 0;    ///< age of the oldest waiting scan
  double cost_s = 0;      ///< recent cost of a scan
  double interval_s = 0;  ///< recent interval between arrivals
};

/// True if processing the waiting scans one by one would delay the newest by more than the arrival time of
/// `together` scans.
///
/// w / T scans wait, for a wait w of the oldest and an interval T of arrivals; at a cost c each, the newest
/// is done w/T · c later. If c < T on average, bursts pass: the queue shortens by 1 − c/T of the mapped
/// scans. If not, it grows beyond any limit. At this limit joining costs no more than it gains: surfaces in
/// the first of K joined scans are found with the last, which arrives K · T later.
bool falls_behind(const Waiting& waiting, std::size_t together);

/// Decides whether the mapper has fallen behind, so that waiting scans are better mapped together: from
/// falls_behind() until none waits any more.
class Backlog {
 public:
  /// `together`: maximum number of scans; 1: never join.
  explicit Backlog(std::size_t together);

  /// The next scan to be mapped, with its time stamp and its waiting time; at most 0: the mapper waited for
  /// it.
  void next(double stamp_s, double waited_s);
  /// After next(): whether other waiting scans should be mapped with it.
  bool join() const { return behind_; }
  /// Another scan mapped with it.
  void joined(double stamp_s);
  /// The scans are mapped.
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
