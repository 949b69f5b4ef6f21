// octosurf/changes.hpp and stairs.hpp in Python.
#include "map_holder.hpp"

#include <octosurf/changes.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf::python {

void bind_changes(Module& module) {
  Value<MapChanges>(module, "MapChanges")
      .fields(OCTOSURF_FIELDS(MapChanges, since, revision, appeared, changed, gone, merged, split,
                              cylinders_appeared, cylinders_changed, cylinders_gone, cylinders_merged));
  module.def("changes_since", &changes_since, "snapshot"_a, "since"_a);
  Value<Step>(module, "Step")
      .fields(OCTOSURF_FIELDS(Step, lower, upper, riser_m, width_m, heading_rad, edge));
  Value<MeanLength>(module, "MeanLength").fields(OCTOSURF_FIELDS(MeanLength, mean_m, std_m));
  Value<Stair>(module, "Stair")
      .fields(OCTOSURF_FIELDS(Stair, id, kind, steps, treads, landing_below, landing_above, riser, tread,
                              width_m, heading_rad, turn_rad));
  Value<Stairs>(module, "Stairs")
      .fields(OCTOSURF_FIELDS(Stairs, stairs, single_steps))
      .def("__len__", [](const Stairs& self) { return self.stairs.size(); });
  module.def(
      "find_stairs",
      [](const SnapshotPtr& snapshot, const std::optional<Eigen::Vector3d>& up) {
        return find_stairs(*snapshot, up_in(snapshot, up));
      },
      "snapshot"_a, py::kw_only(), "up"_a = py::none(), Released(),
      "Stairs among the level surfaces of a Snapshot; up: (3,), of any length, the map's own by default.");
  module.def(
      "nearest_stair",
      [](const Snapshot& snapshot, const Stairs& stairs, const Eigen::Vector3d& point) {
        const Stair* const found = nearest_stair(snapshot, stairs.stairs, point);
        return found == nullptr ? std::optional<Stair>() : *found;
      },
      "snapshot"_a, "stairs"_a, "point"_a);
}

}  // namespace octosurf::python
