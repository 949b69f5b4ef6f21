#pragma once

#include "io/map_lock.hpp"
#include "middleware.hpp"
#include "node_options.hpp"
#include "planning/questions.hpp"
#include "sensors.hpp"

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <octosurf/judgement.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/space_part.hpp>

namespace octosurf::node {

/// Counts of scans by state. Every received scan is waiting, in progress, or in one of the other counts.
struct MappingCounts {
  std::uint64_t received = 0;
  std::uint64_t waiting = 0;
  std::uint64_t mapped = 0;
  std::uint64_t rejected = 0;          ///< clearly off, and not to be put right (mapper.hpp)
  std::uint64_t refused = 0;           ///< damaged, without a pose, …
  std::uint64_t dropped = 0;           ///< made way for newer ones
  std::uint64_t transforms = 0;        ///< messages of tf
  std::uint64_t messages_refused = 0;  ///< of tf and CameraInfo
  std::string last_refusal;
  double scan_ms = 0;         ///< of work on the last scan mapped
  std::string contradiction;  ///< of the scans mapped so far: Judgement::describe()
};

/// The map after some scan.
struct MapMoment {
  std::shared_ptr<const Snapshot> snapshot;
  std::int64_t stamp_ns = 0;  ///< of the last scan mapped, since the node was started, or of the one before
  std::optional<Eigen::Vector3d> sensor;  ///< where it was taken from; empty: none was
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

/// A queue of received scans with a limit in bytes: beyond it the oldest are dropped, so that mapping stays
/// near the robot's current place. Not thread-safe.
class ScanQueue {
 public:
  struct Item {
    RawMessage message;
    std::chrono::steady_clock::time_point came;
  };

  explicit ScanQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Returns how many made way; a message that is larger than all the queue is one of them.
  std::size_t push(Item item) {
    bytes_ += item.message.bytes.size();
    items_.push_back(std::move(item));
    std::size_t dropped = 0;
    for (; bytes_ > most_bytes_; ++dropped) pop();
    return dropped;
  }

  std::optional<Item> pop() {
    if (items_.empty()) return std::nullopt;
    std::optional<Item> first = std::move(items_.front());
    items_.pop_front();
    bytes_ -= first->message.bytes.size();
    return first;
  }

  std::size_t size() const { return items_.size(); }

 private:
  std::size_t most_bytes_, bytes_ = 0;
  std::deque<Item> items_;
};

/// The map and its thread: requests are served between two scans, or from snapshots in parallel.
class Mapping {
 public:
  Mapping(Map start, const NodeOptions& options);

  void add_scan(RawMessage message);
  void add_transforms(const RawMessage& message, bool fixed);
  void add_camera(const RawMessage& message);

  /// Both wait for the current scan, return a line of summary, and throw as save_map() and load_map(). A
  /// loaded map replaces the current one and becomes the node's own; waiting scans are inserted into it.
  /// `stem` empty: the node's own.
  std::string save(const std::string& stem);
  std::string load(const std::string& stem);
  /// Likewise, as Mapper::clear().
  std::string clear(const SpacePart& part, bool as_free);

  Sensors& sensors() { return sensors_; }
  MapMoment moment() const;
  /// The map at that moment for queries, updated from the one before; up is the map's parameter, else z (REP
  /// 103).
  std::shared_ptr<const planning::AskedMap> asked(const MapMoment& moment) const;
  MappingCounts counts() const;
  bool failed() const;  ///< the map is incomplete; finish() reports the reason

  /// Maps waiting scans, unless `hurry`, saves, and throws the exception that ended mapping. Nothing may be
  /// added afterwards.
  void finish(const std::function<bool()>& hurry);

 private:
  using Work = std::function<void()>;

  void run(const std::stop_token& stop);
  void map_scan(const ScanQueue::Item& item, const std::stop_token& stop);
  void save_checkpoint();
  void do_between_scans(Work work);
  void show(const ReceivedScan* received = nullptr);
  void warn(const std::string& what);
  void refuse(const std::string& what, std::uint64_t& count);

  const NodeOptions& options_;
  Sensors sensors_;
  std::shared_ptr<Mapper> mapper_;  // of the thread, as are the next seven
  std::string own_;                 // stem of the node's own map
  io::MapLock lock_;                // of it
  Sensors::Clock::time_point saved_ = Sensors::Clock::now();
  std::optional<std::int64_t> last_stamp_ns_;
  bool changed_ = false;  // since it was saved
  RecordingJudge judge_;
  std::uint64_t judged_ = 0;  // scans

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable_any work_;
  ScanQueue queue_;
  bool idle_ = true;  // no scan is at hand
  std::deque<std::packaged_task<void()>> tasks_;
  MappingCounts counts_;
  Sensors::Clock::time_point told_{};    // of a refusal
  std::shared_ptr<const Mapper> shown_;  // its snapshot is read on demand
  std::uint64_t revision_ = 0;           // that is shown
  std::int64_t stamp_ns_ = 0;            // of the last scan mapped
  std::optional<Eigen::Vector3d> sensor_;
  Eigen::Vector3d up_;
  std::exception_ptr failure_;
  mutable std::mutex asking_;                                // of the next
  mutable std::shared_ptr<const planning::AskedMap> asked_;  // last

  std::jthread thread_;
};

}  // namespace octosurf::node
