// Snapshots of a map and what has gone from it in Python.
#include "bind.hpp"
#include "casters.hpp"

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
std::shared_ptr<T> found(const std::vector<std::shared_ptr<const T>>& all, std::uint32_t id) {
  const auto at = std::lower_bound(all.begin(), all.end(), id,
                                   [](const auto& one, std::uint32_t wanted) { return one->id < wanted; });
  return at != all.end() && (*at)->id == id ? std::const_pointer_cast<T>(*at) : nullptr;
}

/// Python knows no const; nothing that it is given can change one.
template <class T>
std::vector<std::shared_ptr<T>> shared(const std::vector<std::shared_ptr<const T>>& all) {
  std::vector<std::shared_ptr<T>> given;
  given.reserve(all.size());
  for (const auto& one : all) given.push_back(std::const_pointer_cast<T>(one));
  return given;
}

void bind_departure(py::module_& module) {
  py::class_<Departure>(module, "Departure", "A surface or cylinder that is no more.")
      .def_readonly("of", &Departure::of, R"("surface" or "cylinder".)")
      .def_readonly("id", &Departure::id, "Never used again.")
      .def_readonly("into", &Departure::into,
                    "Id of what took it in; 0: its points are pending again, or vanished.")
      .def_readonly("born", &Departure::born, "Map revision in which it appeared; 0: before maps noted that.")
      .def_readonly("revision", &Departure::revision, "Map revision in which it went.")
      .def_readonly("parents", &Departure::parents, "As Surface.parents when it went.");
}

}  // namespace

void bind_snapshot(py::module_& module) {
  bind_departure(module);
  py::class_<Snapshot, std::shared_ptr<Snapshot>>(
      module, "Snapshot", "A consistent view of all surfaces at one revision; never changes, cheap to keep.")
      .def_readonly("revision", &Snapshot::revision, "Of the map.")
      .def_readonly("resolution", &Snapshot::resolution, "d of the map, m.")
      .def_property_readonly(
          "surfaces", [](const Snapshot& self) { return shared(self.surfaces); },
          "List of Surface, ascending id.")
      .def_property_readonly(
          "cylinders", [](const Snapshot& self) { return shared(self.cylinders); },
          "List of Cylinder, ascending id.")
      .def_readonly(
          "octree", &Snapshot::octree,
          "OccupancyView of the same scan; knows nothing unless Mapper.share_octree() was called before.")
      .def(
          "find", [](const Snapshot& self, SurfaceId id) { return found(self.surfaces, id); }, py::arg("id"),
          "The Surface of this id, or None.")
      .def(
          "find_cylinder", [](const Snapshot& self, CylinderId id) { return found(self.cylinders, id); },
          py::arg("id"), "The Cylinder of this id, or None.")
      .def(
          "changed_since",
          [](const Snapshot& self, std::uint64_t revision) { return shared(self.changed_since(revision)); },
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
