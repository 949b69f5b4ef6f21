// octosurf/changes.hpp in Python.
#include "bind.hpp"
#include "casters.hpp"

#include <memory>
#include <utility>
#include <vector>

#include <octosurf/changes.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

/// Pairs (before, now) of ids.
template <class Heir>
std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_of(const std::vector<Heir>& heirs) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Heir& heir : heirs) pairs.emplace_back(heir.before, heir.now);
  return pairs;
}

void bind_since(py::module_& module) {
  using C = MapChanges;
  py::class_<C>(module, "MapChanges", "What became of what somebody knew at an earlier revision. Ids ascend.")
      .def_readonly("since", &C::since, "The earlier revision.")
      .def_readonly("revision", &C::revision, "The present one.")
      .def_readonly("appeared", &C::appeared, "Ids of surfaces that were not there.")
      .def_readonly("changed", &C::changed, "Ids of surfaces with another plane, polygon or covariance.")
      .def_readonly("gone", &C::gone, "Ids of surfaces that nothing there now holds.")
      .def_property_readonly(
          "merged", [](const C& self) { return pairs_of(self.merged); },
          "List of (before, now): `before` is no more, `now` holds all or a part of it.")
      .def_property_readonly(
          "split", [](const C& self) { return pairs_of(self.split); },
          "List of (before, now): `before` is still there, `now` has a part of it.")
      .def_readonly("cylinders_appeared", &C::cylinders_appeared, "Ids.")
      .def_readonly("cylinders_changed", &C::cylinders_changed, "Ids.")
      .def_readonly("cylinders_gone", &C::cylinders_gone, "Ids.")
      .def_property_readonly(
          "cylinders_merged", [](const C& self) { return pairs_of(self.cylinders_merged); }, "As merged.");
  module.def("changes_since", &changes_since, py::arg("snapshot"), py::arg("since"),
             R"(MapChanges: everything that happened after revision `since`, over any number of scans.

Who drops `gone` and every `before` of `merged`, and reads `appeared` and `changed` anew, has what the snapshot has.
Throws Error(usage) for a revision to come.)");
}

}  // namespace

void bind_changes(py::module_& module) {
  bind_since(module);
  using D = SurfaceDifference;
  py::class_<D>(module, "SurfaceDifference",
                "A surface of one of two maps, and how much of it the other map has, too.")
      .def_readonly("id", &D::id, "Of the surface.")
      .def_readonly("area_m2", &D::area_m2, "m2, of its polygons.")
      .def_readonly("shared_m2", &D::shared_m2, "m2 of that, over or under a polygon of the other map's.")
      .def_readonly("free_m2", &D::free_m2,
                    "m2 of the rest, in space that the other map's octree has seen free: it is gone.")
      .def_readonly("unseen_m2", &D::unseen_m2, "m2 of the rest, in space that the other map has not seen.")
      .def_readonly("other", &D::other, "Id of the other map's that holds most of it; 0: none.")
      .def_readonly("offset_m", &D::offset_m, "m, of `other` from it along its normal.")
      .def_readonly("angle_rad", &D::angle_rad, "rad, between the normals.");
  py::class_<MapDifference>(module, "MapDifference", "Two maps compared.")
      .def_readonly("before", &MapDifference::before,
                    "List of SurfaceDifference, every surface of the first.")
      .def_readonly("after", &MapDifference::after, "Likewise of the second.");
  module.def(
      "compare_maps",
      [](const std::shared_ptr<Snapshot>& before, const std::shared_ptr<Snapshot>& after, double tolerance) {
        const py::gil_scoped_release others_run;
        return compare_maps(*before, *after, tolerance);
      },
      py::arg("before"), py::arg("after"), py::arg("tolerance") = 0.0,
      R"(MapDifference of two Snapshots of one place as they lie, whatever their ids.

tolerance: m that a surface may lie over or under the other map's; 0: twice the coarser d.)");
}

}  // namespace octosurf::python
