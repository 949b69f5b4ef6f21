// octosurf/stairs.hpp in Python.
#include "bind.hpp"
#include "map_up.hpp"
#include "values.hpp"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/stairs.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

using Ends = std::vector<Eigen::Vector3d>;
using Pairs = std::vector<std::pair<SurfaceId, SurfaceId>>;

void bind_changes_of_stairs(py::module_& module) {
  using C = StairChanges;
  Value<C>(module, "StairChanges", "What became of the stairs that somebody knew. Ids ascend.")
      .field("appeared", &C::appeared, "Ids now, of stairs that have no part of an earlier one.")
      .field("changed", &C::changed, "Ids now, of those with other steps, treads, landings or measures.")
      .field("gone", &C::gone, "Earlier ids, of those of which no stair has a part.")
      .field<Pairs>(
          "renamed",
          [](const C& self) {
            Pairs pairs;
            for (const MapChanges::Heir& heir : self.renamed) pairs.emplace_back(heir.before, heir.now);
            return pairs;
          },
          [](C& self, const Pairs& pairs) {
            for (const auto& [before, now] : pairs) self.renamed.push_back({before, now});
          },
          "List of (before, now) of a stair whose id is another now.");
  module.def(
      "stair_changes",
      [](const Stairs& before, std::uint64_t since, const Snapshot& snapshot, const Stairs& now) {
        return stair_changes(before.stairs, since, snapshot, now.stairs);
      },
      py::arg("before"), py::arg("since"), py::arg("snapshot"), py::arg("now"),
      R"(StairChanges between Stairs found at revision `since` and those of a snapshot of the same map.

Treads are followed through mergers and splits.)");
}

std::optional<Stair> stair_near(const std::shared_ptr<Snapshot>& snapshot, const Stairs& stairs,
                                const Eigen::Vector3d& point) {
  const Stair* const found = nearest_stair(*snapshot, stairs.stairs, point);
  if (found == nullptr) return {};
  return *found;
}

}  // namespace

void bind_stairs(py::module_& module) {
  Value<Step>(module, "Step", "Where one level surface rises above another at a straight front edge.")
      .field("lower", &Step::lower, "Id of the surface before the edge; of several, of its widest part.")
      .field("upper", &Step::upper, "Id of the surface that the edge bounds, likewise.")
      .field("riser_m", &Step::riser_m, "m, between the two planes at the middle of the edge.")
      .field("width_m", &Step::width_m, "m, of the edge.")
      .field("heading_rad", &Step::heading_rad, "rad about up, of somebody who steps up.")
      .field<Ends>(
          "edge", [](const Step& self) { return Ends(self.edge.begin(), self.edge.end()); },
          [](Step& self, const Ends& ends) {
            self.edge = {ends.at(0), ends.at(1)};
          },
          "Its left and right end, (3,) float64 each, map frame, m.");
  Value<MeanLength>(module, "MeanLength", "Mean and standard deviation of a length.")
      .field("mean_m", &MeanLength::mean_m, "m.")
      .field("std_m", &MeanLength::std_m, "m, over the stair.");
  Value<Stair>(module, "Stair", "Level surfaces that rise by nearly equal steps.")
      .field("id", &Stair::id, "Of the oldest surface among its treads: the same after more scans.")
      .field("kind", &Stair::kind, R"("straight", "turning" or "spiral".)")
      .field("steps", &Stair::steps, "List of Step, from below; as many as risers.")
      .field("treads", &Stair::treads, "Ids of surfaces, from below, landings between flights included.")
      .field("landing_below", &Stair::landing_below,
             "Id of the larger surface at the lower end; 0: not seen.")
      .field("landing_above", &Stair::landing_above, "Likewise at the upper end.")
      .field("riser", &Stair::riser, "MeanLength of all steps.")
      .field("tread", &Stair::tread, "MeanLength from front edge to front edge; landings left out.")
      .field("width_m", &Stair::width_m, "m, median of the edges'.")
      .field("heading_rad", &Stair::heading_rad, "rad, of a straight one's flights, else of the lowest step.")
      .field("turn_rad", &Stair::turn_rad, "rad, from the lowest to the highest step, counter-clockwise.");
  Value<Stairs>(module, "Stairs", "What find_stairs() found.")
      .field("stairs", &Stairs::stairs, "List of Stair, ascending id.")
      .field("single_steps", &Stairs::single_steps, "List of Step: of no stair, such as kerbs.")
      .def("__len__", [](const Stairs& self) { return self.stairs.size(); });
  module.def(
      "find_stairs",
      [](const std::shared_ptr<Snapshot>& snapshot, const std::optional<Eigen::Vector3d>& up) {
        const Eigen::Vector3d direction = up_in(snapshot, up);
        const py::gil_scoped_release others_run;
        return find_stairs(*snapshot, direction);
      },
      py::arg("snapshot"), py::kw_only(), py::arg("up") = py::none(),
      R"(Stairs among the level surfaces of a Snapshot, by their heights and outlines alone.

up: (3,), of any length; the map's own by default. Limits of steps and treads: octosurf/stairs.hpp.)");
  module.def(
      "nearest_stair", &stair_near, py::arg("snapshot"), py::arg("stairs"), py::arg("point"),
      "The Stair of this snapshot's Stairs whose tread is nearest to a point, (3,), m; None without any.");
  bind_changes_of_stairs(module);
}

}  // namespace octosurf::python
