#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <utility>

#include <octosurf/surface.hpp>

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

/// Null if it did not come from a map, but from a pickle.
template <class T>
std::shared_ptr<const MapUp> map_up(const std::shared_ptr<T>& one) {
  const auto* const map = std::get_deleter<OfMap<T>>(one);
  return map ? map->up : nullptr;
}

/// `wanted`, else the map's own: as its parameters give it, or estimated from the snapshot's surfaces.
Eigen::Vector3d up_in(const std::shared_ptr<Snapshot>& snapshot,
                      const std::optional<Eigen::Vector3d>& wanted = {});

/// `wanted`, else what the parameters of its map give. Throws Error(usage) where they do not: a single
/// surface says nothing of up.
Eigen::Vector3d up_in(const std::shared_ptr<Surface>& surface, const std::optional<Eigen::Vector3d>& wanted);

}  // namespace octosurf::python
