#pragma once

#include "bind.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::python {

/// The up direction of the map of a snapshot or surface: the default of functions that need one.
struct MapUp {
  std::optional<Eigen::Vector3d> given;                  ///< Parameters::up
  Eigen::Vector3d sensors_up = Eigen::Vector3d::Zero();  ///< of the scans, as estimate_up() takes it
};

/// Deletes nothing: what it keeps does. Python's pointers have it, because what they point to does not know
/// its map.
template <class T>
struct OfMap {
  std::shared_ptr<const T> kept;
  std::shared_ptr<const MapUp> up;
  void operator()(const T* /*kept*/) const {}
};

/// Python has no const: this pointer must not give access to mutable data.
template <class T>
std::shared_ptr<T> of_map(std::shared_ptr<const T> one, std::shared_ptr<const MapUp> up) {
  T* const raw = const_cast<T*>(one.get());
  return std::shared_ptr<T>(raw, OfMap<T>{std::move(one), std::move(up)});
}

/// Null if it did not come from a map.
template <class T>
std::shared_ptr<const MapUp> map_up(const std::shared_ptr<T>& one) {
  const auto* const map = std::get_deleter<OfMap<T>>(one);
  return map ? map->up : nullptr;
}

/// `wanted`, else the map's own: as its parameters give it, or estimated from the snapshot's surfaces.
Eigen::Vector3d up_in(const SnapshotPtr& snapshot, const std::optional<Eigen::Vector3d>& wanted = {});

/// `wanted`, else what the parameters of its map give. Throws Error(usage) where they do not: a single
/// surface says nothing of up.
Eigen::Vector3d up_in(const std::shared_ptr<Surface>& surface, const std::optional<Eigen::Vector3d>& wanted);

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
    if constexpr (std::is_void_v<decltype(change(*mapper_))>)
      change(*mapper_);  // of how snapshots are made: no surface changes
    else
      return noted(change(*mapper_));
  }

  /// `change(Mapper&, const Map&)` of a map that has been taken over, and another one that is read; likewise.
  template <class Change>
  auto write_with(const MapHolder& other, Change change) {
    const pybind11::gil_scoped_release others_run;
    const std::scoped_lock alone(busy_, other.busy_);  // both at once: another thread may want them crosswise
    return noted(change(*mapper_, other.mapper_ ? other.mapper_->map() : *other.map_));
  }

  /// Of a map that has been taken over; waits for no insertion.
  PreparedScan prepare(Scan scan) const {
    const pybind11::gil_scoped_release others_run;
    return mapper_->prepare(std::move(scan));
  }

  /// Never waits for a scan. With Python's lock, without which take_over() is not called, or after that.
  SnapshotPtr snapshot() const;

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
  mutable std::mutex up_busy_;  ///< held briefly; snapshot() never blocks longer
  std::shared_ptr<const MapUp> up_;
};

}  // namespace octosurf::python

template <>
struct pybind11::detail::type_caster<std::shared_ptr<octosurf::python::MapHolder>>
    : held_caster<octosurf::python::MapHolder> {};

namespace octosurf::python {

/// Calls a method of Map, or a function of a Map, while the map is locked.
template <class Answer, class... Arguments>
auto under_lock(Answer (Map::*question)(Arguments...) const) {
  return [question](const MapHolder& map, Arguments... arguments) {
    return map.read([&](const Map& whole) { return (whole.*question)(arguments...); });
  };
}
template <class Answer, class... Arguments>
auto under_lock(Answer (*question)(const Map&, Arguments...)) {
  return [question](const MapHolder& map, Arguments... arguments) {
    return map.read([&](const Map& whole) { return question(whole, arguments...); });
  };
}

/// Of a new map: the given or default ones, modified by the keyword arguments.
Parameters parameters_of(const std::optional<Parameters>& given, const pybind11::kwargs& fields);

using MapPtr = std::shared_ptr<MapHolder>;

}  // namespace octosurf::python
