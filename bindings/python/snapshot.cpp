// Snapshots of a map and its departures in Python.
#include "bind.hpp"
#include "map_up.hpp"
#include "values.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/departures.hpp>
#include <octosurf/surface.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

/// The one of this id among all, ascending by id; null if there is none.
template <class T>
std::shared_ptr<T> found(const std::vector<std::shared_ptr<const T>>& all, std::uint32_t id,
                         const std::shared_ptr<const MapUp>& up) {
  const auto at = std::lower_bound(all.begin(), all.end(), id,
                                   [](const auto& one, std::uint32_t wanted) { return one->id < wanted; });
  return at != all.end() && (*at)->id == id ? of_map(*at, up) : nullptr;
}

template <class T>
std::vector<std::shared_ptr<T>> shared(const std::vector<std::shared_ptr<const T>>& all,
                                       const std::shared_ptr<const MapUp>& up) {
  std::vector<std::shared_ptr<T>> given;
  given.reserve(all.size());
  for (const auto& one : all) given.push_back(of_map(one, up));
  return given;
}

void bind_departure(py::module_& module) {
  Value<Departure>(module, "Departure", "A surface or cylinder that is no more.")
      .field("of", &Departure::of, R"("surface" or "cylinder".)")
      .field("id", &Departure::id, "Never used again.")
      .field("into", &Departure::into, "Id of what took it in; 0: its points are pending again, or vanished.")
      .field("born", &Departure::born, "Map revision in which it appeared; 0: before maps noted that.")
      .field("revision", &Departure::revision, "Map revision in which it went.")
      .field("parents", &Departure::parents, "As Surface.parents when it went.");
}

}  // namespace

void bind_snapshot(py::module_& module) {
  using Ptr = std::shared_ptr<Snapshot>;
  bind_departure(module);
  py::class_<Snapshot, Ptr>(
      module, "Snapshot", "A consistent view of all surfaces at one revision; never changes, cheap to keep.")
      .def_readonly("revision", &Snapshot::revision, "Of the map.")
      .def_readonly("resolution", &Snapshot::resolution, "d of the map, m.")
      .def_property_readonly(
          "surfaces", [](const Ptr& self) { return shared(self->surfaces, map_up(self)); },
          "List of Surface, ascending id.")
      .def_property_readonly(
          "cylinders", [](const Ptr& self) { return shared(self->cylinders, map_up(self)); },
          "List of Cylinder, ascending id.")
      .def_readonly(
          "octree", &Snapshot::octree,
          "OccupancyView of the same scan; knows nothing unless Mapper.share_octree() was called before.")
      .def(
          "up", [](const Ptr& self) { return up_in(self); },
          R"((3,) float64, unit: up in its map, as the parameters give it or, where they leave it open, estimated.

The estimate is up_of(map)'s, made anew each time: O(n^2) in surfaces, a few ns each.)")
      .def(
          "find", [](const Ptr& self, SurfaceId id) { return found(self->surfaces, id, map_up(self)); },
          py::arg("id"), "The Surface of this id, or None.")
      .def(
          "find_cylinder",
          [](const Ptr& self, CylinderId id) { return found(self->cylinders, id, map_up(self)); },
          py::arg("id"), "The Cylinder of this id, or None.")
      .def(
          "changed_since",
          [](const Ptr& self, std::uint64_t revision) {
            return shared(self->changed_since(revision), map_up(self));
          },
          py::arg("revision"), "List of the Surfaces changed after `revision`.")
      .def(
          "departures",
          [](const Snapshot& self, std::uint64_t since) {
            std::vector<Departure> gone;
            self.departures.for_each_since(since, [&gone](const Departure& one) { gone.push_back(one); });
            return gone;
          },
          py::arg("since") = 0, "List of Departure after revision `since`, oldest first.")
      .def("__len__", [](const Snapshot& self) { return self.surfaces.size(); })
      .def("__repr__", [](const Snapshot& self) {
        return "<Snapshot at revision " + std::to_string(self.revision) + ": " +
               std::to_string(self.surfaces.size()) + " surfaces>";
      });
}

}  // namespace octosurf::python
