// octosurf/changes.hpp in Python.
#include "bind.hpp"
#include "values.hpp"

#include <memory>
#include <utility>
#include <vector>

#include <octosurf/changes.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

/// Of ids: (before, now).
using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// A field of heirs as pairs.
template <class Heir>
void add_pairs(Value<MapChanges>& changes, const char* name, std::vector<Heir> MapChanges::*heirs,
               const char* doc) {
  changes.field<Pairs>(
      name,
      [heirs](const MapChanges& self) {
        Pairs pairs;
        for (const Heir& heir : self.*heirs) pairs.emplace_back(heir.before, heir.now);
        return pairs;
      },
      [heirs](MapChanges& self, const Pairs& pairs) {
        for (const auto& [before, now] : pairs) (self.*heirs).push_back({before, now});
      },
      doc);
}

void bind_since(py::module_& module) {
  using C = MapChanges;
  Value<C> changes(module, "MapChanges",
                   "What became of what somebody knew at an earlier revision. Ids ascend.");
  changes.field("since", &C::since, "The earlier revision.")
      .field("revision", &C::revision, "The present one.")
      .field("appeared", &C::appeared, "Ids of surfaces that were not there.")
      .field("changed", &C::changed, "Ids of surfaces with another plane, polygon or covariance.")
      .field("gone", &C::gone, "Ids of surfaces that nothing there now holds.");
  add_pairs(changes, "merged", &C::merged,
            "List of (before, now): `before` is no more, `now` holds all or a part of it.");
  add_pairs(changes, "split", &C::split,
            "List of (before, now): `before` is still there, `now` has a part of it.");
  changes.field("cylinders_appeared", &C::cylinders_appeared, "Ids.")
      .field("cylinders_changed", &C::cylinders_changed, "Ids.")
      .field("cylinders_gone", &C::cylinders_gone, "Ids.");
  add_pairs(changes, "cylinders_merged", &C::cylinders_merged, "As merged.");
  module.def("changes_since", &changes_since, py::arg("snapshot"), py::arg("since"),
             R"(MapChanges: everything that happened after revision `since`, over any number of scans.

Who drops `gone` and every `before` of `merged`, and reads `appeared` and `changed` anew, has what the snapshot has.
Throws Error(usage) for a revision to come.)");
}

}  // namespace

void bind_changes(py::module_& module) {
  bind_since(module);
  using D = SurfaceDifference;
  Value<D>(module, "SurfaceDifference",
           "A surface of one of two maps, and how much of it the other map has, too.")
      .field("id", &D::id, "Of the surface.")
      .field("area_m2", &D::area_m2, "m2, of its polygons.")
      .field("shared_m2", &D::shared_m2, "m2 of that, over or under a polygon of the other map's.")
      .field("free_m2", &D::free_m2,
             "m2 of the rest, in space that the other map's octree has seen free: it is gone.")
      .field("unseen_m2", &D::unseen_m2, "m2 of the rest, in space that the other map has not seen.")
      .field("other", &D::other, "Id of the other map's that holds most of it; 0: none.")
      .field("offset_m", &D::offset_m, "m, of `other` from it along its normal.")
      .field("angle_rad", &D::angle_rad, "rad, between the normals.");
  Value<MapDifference>(module, "MapDifference", "Two maps compared.")
      .field("before", &MapDifference::before, "List of SurfaceDifference, every surface of the first.")
      .field("after", &MapDifference::after, "Likewise of the second.");
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
