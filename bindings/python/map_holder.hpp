#pragma once

#include "map_up.hpp"

#include <memory>
#include <mutex>
#include <optional>
#include <pybind11/pybind11.h>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::python {

/// Null where the module is built without PCL.
const detection::Detector* papers_detector();

/// A map, with its Mapper once there is one. Python's Map and Mapper share it: either keeps the map alive,
/// and one thread's queries wait for another's insertion.
class MapHolder {
 public:
  explicit MapHolder(Map map) : map_(std::move(map)) { note_up(*map_); }

  /// Hands the map to a Mapper. Throws Error(usage) if it has one.
  void take_over(int threads) {
    const std::lock_guard alone(busy_);
    if (mapper_)
      throw Error(Error::Kind::usage, "map", "has a Mapper already",
                  "insert with that one, or load the map anew");
    mapper_.emplace(std::move(*map_), threads, papers_detector());
    map_.reset();
  }

  /// Calls `query(const Map&)` while nothing inserts, with Python's other threads running.
  template <class Query>
  auto read(Query query) const {
    const pybind11::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    return query(mapper_ ? mapper_->map() : *map_);
  }

  /// `change(Mapper&)` of a map that has been taken over; likewise.
  template <class Change>
  auto write(Change change) {
    const pybind11::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    return noted(change(*mapper_));
  }

  /// `set(Mapper&)` of a map that has been taken over, where that changes no surface; likewise.
  template <class Set>
  void configure(Set set) {
    const pybind11::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    set(*mapper_);
  }

  /// `change(Mapper&, const Map&)` of a map that has been taken over, and another one that is read; likewise.
  template <class Change>
  auto write_with(const MapHolder& other, Change change) {
    const pybind11::gil_scoped_release others_run;
    const std::scoped_lock alone(busy_, other.busy_);  // both at once: another thread may want them crosswise
    return noted(change(*mapper_, other.mapper_ ? other.mapper_->map() : *other.map_));
  }

  /// Never waits for a scan. With Python's lock, without which take_over() is not called.
  std::shared_ptr<Snapshot> snapshot() const;

 private:
  void note_up(const Map& map);

  /// What a change gives, once it is known how the sensors were held.
  template <class Report>
  Report noted(Report report) {
    note_up(mapper_->map());
    return report;
  }

  mutable std::mutex busy_;
  std::optional<Map> map_;
  std::optional<Mapper> mapper_;
  mutable std::mutex up_busy_;  ///< a moment: snapshot() waits for nothing longer
  std::shared_ptr<const MapUp> up_;
};

/// Of a new map: the given or default ones, modified by the keyword arguments.
Parameters parameters_of(const std::optional<Parameters>& given, const pybind11::kwargs& fields);

using MapPtr = std::shared_ptr<MapHolder>;

}  // namespace octosurf::python
