// octosurf/footsteps.hpp and plan_files.hpp in Python.
#include "bind.hpp"
#include "fields.hpp"
#include "map_up.hpp"

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/footsteps.hpp>
#include <octosurf/plan_files.hpp>

namespace py = pybind11;

namespace octosurf::python {
namespace {

using SurfaceEdges = std::map<SurfaceId, std::vector<PolygonEdges>>;

/// A planner with a lock, for several threads.
class SharedPlanner {
 public:
  SharedPlanner(std::shared_ptr<Snapshot> snapshot, OccupancyView octree, Robot robot, SurfaceEdges edges)
      : revision_(snapshot->revision),
        planner_(std::move(snapshot), std::move(octree), std::move(robot), std::move(edges)) {}

  FootstepPlan plan(Standing from, Standing to, PlanBudget budget) {
    const py::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    return planner_.plan(from, to, budget);
  }

  std::string described() const {
    return "<FootstepPlanner over the surfaces of revision " + std::to_string(revision_) + ">";
  }

 private:
  std::mutex busy_;
  std::uint64_t revision_;
  FootstepPlanner planner_;
};

/// The given octree, or the snapshot's own; unknown space counts as free, so none at all is refused.
OccupancyView octree_of(const Snapshot& snapshot, const std::optional<OccupancyView>& given) {
  OccupancyView octree = given.value_or(snapshot.octree);
  if (octree.resolution() == 0)
    throw Error(Error::Kind::usage, "octree", "is missing",
                "give map.octree(), or call Mapper.share_octree() first");
  return octree;
}

Robot robot_in(const std::shared_ptr<Snapshot>& snapshot, const std::optional<Robot>& given) {
  if (given) return *given;
  Biped biped;
  biped.contact.up = up_in(snapshot);
  return biped;
}

void bind_settings(py::module_& module) {
  Settings<BodyBox>(module, "BodyBox", "The upright box about a robot's trunk that nothing may stand in, m.")
      .field("length_m", &BodyBox::length_m, "m along its heading.")
      .field("width_m", &BodyBox::width_m, "m.")
      .field("from_m", &BodyBox::from_m, "m above the ground under it.")
      .field("to_m", &BodyBox::to_m, "m above the ground under it.");
  using C = StepCosts;
  Settings<C>(module, "StepCosts", "What is dear in a step besides that it is one, which costs 1.")
      .field("length", &C::length, "Of the longest step; in proportion for shorter ones.")
      .field("height", &C::height, "Of the highest.")
      .field("turn", &C::turn, "Of the widest turn.")
      .field("margin", &C::margin, "On an edge; nothing from good_margin_m on.")
      .field("slope", &C::slope, "On the steepest slope.")
      .field("uncertainty", &C::uncertainty, "On a plane that may be uncertain_m off.")
      .field("good_margin_m", &C::good_margin_m, "m.")
      .field("uncertain_m", &C::uncertain_m, "m.");
  using B = PlanBudget;
  Settings<B>(module, "PlanBudget", "When to stop.")
      .field("expansions", &B::expansions, "To find a plan at all.")
      .field("improving", &B::improving, "After the first plan, to find better ones.")
      .field("time_s", &B::time_s, "s, of the search; None: any. With it results depend on the machine.");
  using S = Standing;
  Settings<S>(module, "Standing", "Where a robot stands.")
      .field("at", &S::at, "(3,) float64, map frame, m: the ground between its feet; a view.")
      .field("yaw_rad", &S::yaw_rad, "rad: its heading about up, counter-clockwise from the map's x axis.");
}

/// What both robots have.
template <class R>
void add_common_fields(Settings<R>& robot) {
  robot.field("foot", &R::foot, "ContactShape.")
      .field("contact", &R::contact, "ContactLimits; `contact.up` tells which way is up.")
      .field("stance_width_m", &R::stance_width_m, "m between its feet when it stands.")
      .field("max_up_m", &R::max_up_m, "m, of a step.")
      .field("max_down_m", &R::max_down_m, "m, of a step.")
      .field("max_turn_rad", &R::max_turn_rad, "rad, of a step.")
      .field("lift_m", &R::lift_m, "m of the swinging foot over the higher of the two footholds beside it.")
      .field("high_lift_m", &R::high_lift_m, "m, where it would touch something so.")
      .field("body", &R::body, "BodyBox.")
      .field("costs", &R::costs, "StepCosts.");
  robot.def("validate", &R::validate, "Throws Error(usage) naming field, value and rule.");
  robot.def_static("limits", &R::limits, "The ContactLimits it has unless told otherwise.");
}

void bind_robots(py::module_& module) {
  Settings<Biped> biped(module, "Biped",
                        R"(A robot on two legs, of a man's size; step limits are those of the foot put down.

They are seen from the standing foot: its reference point in the standing foot's heading, level.)");
  add_common_fields(biped);
  biped.field("max_forward_m", &Biped::max_forward_m, "m, of a step.")
      .field("max_backward_m", &Biped::max_backward_m, "m, of a step.")
      .field("min_width_m", &Biped::min_width_m, "m between the feet's reference points, sideways.")
      .field("max_width_m", &Biped::max_width_m, "m, likewise.");
  using Q = Quadruped;
  Settings<Q> quadruped(module, "Quadruped", "A robot on four ball feet, which crawls; sizes of an ANYmal.");
  add_common_fields(quadruped);
  quadruped.field("stance_length_m", &Q::stance_length_m, "m between its feet when it stands.")
      .field("max_step_m", &Q::max_step_m, "m by which the body advances while each foot steps once.")
      .field("max_sideward_m", &Q::max_sideward_m, "m, likewise to a side, and back.")
      .field("reach_m", &Q::reach_m, "m, level, of a foot from below its hip.")
      .field("snap_m", &Q::snap_m, "m from below its hip within which a foothold is looked for.")
      .field("max_sway_m", &Q::max_sway_m, "m, of the body from its straight way.")
      .field("support_margin_m", &Q::support_margin_m,
             "m, of the body's middle inside the triangle of support.");
}

std::map<std::string, std::size_t> refused_of(const NoPlan& none) {
  std::map<std::string, std::size_t> counts;
  for (std::size_t i = 0; i < step_refusal_names.size(); ++i)
    counts[std::string(step_refusal_names[i])] = none.refused[i];
  return counts;
}

void bind_plan(py::module_& module) {
  Value<Footstep>(module, "Footstep", "A foot put down.")
      .field("foot", &Footstep::foot,
             R"("left", "right"; "front_left", "front_right", "hind_left", "hind_right".)")
      .field("surface", &Footstep::surface, "Id.")
      .field("T_map_foot", &Footstep::T_map_foot,
             "(4, 4) float64, reference point, z along the normal; a copy.")
      .field("yaw_rad", &Footstep::yaw_rad, "rad, as Standing's.")
      .field("margin_m", &Footstep::margin_m, "m from the sole to the surface's nearest edge.");
  Value<NoPlan>(module, "NoPlan", "Why there is no plan.")
      .field("why", &NoPlan::why, R"("start", "goal", "unreachable" or "budget".)")
      .field("sentence", &NoPlan::sentence, "One line.")
      .field("contact", &NoPlan::contact,
             "Of start and goal: the limit that keeps the foot from there, or None.")
      .field("nearest", &NoPlan::nearest,
             "(3,) float64, map frame, m, a copy: where it came nearest; of start and goal the "
             "nearest place to stand; or None.")
      .field("nearest_m", &NoPlan::nearest_m, "m from there to the goal, or to the start.")
      .field<std::map<std::string, std::size_t>>(
          "refused", &refused_of,
          [](NoPlan& self, const std::map<std::string, std::size_t>& counts) {
            for (std::size_t i = 0; i < step_refusal_names.size(); ++i)
              self.refused[i] = counts.at(std::string(step_refusal_names[i]));
          },
          R"(dict: footholds nearer to the goal that "reach", "height", "clearance", "support" refused.)");
  using P = FootstepPlan;
  Value<P>(module, "FootstepPlan", "Footsteps, or why there are none.")
      .field("start", &P::start, "List of Footstep: where the feet stand at first.")
      .field("steps", &P::steps, "List of Footstep, one after the other.")
      .field("body", &P::body, "List of Standing: the body's pose at first and after each step.")
      .field("cost", &P::cost, "Of all steps.")
      .field("lower_bound", &P::lower_bound, "No plan on the planner's grid costs less.")
      .field("expansions", &P::expansions, "Of the search.")
      .field("prepare_ms", &P::prepare_ms,
             "ms: contact regions and voxels that no earlier plan had asked for.")
      .field("search_ms", &P::search_ms, "ms: all the rest.")
      .field("refusal", &P::refusal, "NoPlan, or None: there is a plan.")
      .def("found", &P::found, "Whether there is a plan.")
      .def(
          "to_json", [](const P& self, const Robot& robot) { return to_json(self, robot); }, py::arg("robot"),
          R"(A JSON object, "octosurf-plan" of docs/formats.md; degrees.)")
      .def(
          "__bool__", [](const P& self) { return self.found(); }, "found().");
}

}  // namespace

void bind_footsteps(py::module_& module) {
  bind_settings(module);
  bind_robots(module);
  bind_plan(module);
  py::class_<SharedPlanner>(module, "FootstepPlanner", R"(Plans footsteps over the surfaces of one snapshot.

Footholds are accepted by foothold(); swinging feet and body touch no occupied voxel, unknown space counts as free. Statics
only. Deterministic without a time limit. What it finds out about the map it keeps for later plans.)")
      .def(
          py::init([](const std::shared_ptr<Snapshot>& snapshot, const std::optional<Robot>& given,
                      const std::optional<OccupancyView>& octree, SurfaceEdges edges) {
            OccupancyView known = octree_of(*snapshot, octree);
            Robot robot = robot_in(snapshot, given);
            const py::gil_scoped_release others_run;
            return std::make_unique<SharedPlanner>(snapshot, std::move(known), std::move(robot),
                                                   std::move(edges));
          }),
          py::arg("snapshot"), py::arg("robot") = py::none(), py::kw_only(), py::arg("octree") = py::none(),
          py::arg("edges") = SurfaceEdges{},
          R"(robot: Biped or Quadruped; None: Biped() with the map's up. octree: OccupancyView; None: the snapshot's own.
edges: label_edges() by surface id, for limits that ask for them. Throws Error(usage).)")
      .def("__repr__", &SharedPlanner::described)
      .def("plan", &SharedPlanner::plan, py::arg("from_"), py::arg("to"), py::arg("budget") = PlanBudget{},
           "FootstepPlan from one Standing to another; at both ends the feet are put on the footholds "
           "nearest.");
  module.def(
      "plan",
      [](const std::shared_ptr<Snapshot>& snapshot, Standing from, Standing to,
         const std::optional<Robot>& robot, PlanBudget budget, const std::optional<OccupancyView>& octree,
         SurfaceEdges edges) {
        return SharedPlanner(snapshot, octree_of(*snapshot, octree), robot_in(snapshot, robot),
                             std::move(edges))
            .plan(from, to, budget);
      },
      py::arg("snapshot"), py::arg("from_"), py::arg("to"), py::arg("robot") = py::none(),
      py::arg("budget") = PlanBudget{}, py::kw_only(), py::arg("octree") = py::none(),
      py::arg("edges") = SurfaceEdges{},
      "FootstepPlanner(snapshot, robot, …).plan(from_, to, budget), for a single plan.");
  module.def(
      "verify_plan",
      [](const FootstepPlan& plan, const std::shared_ptr<Snapshot>& snapshot, Robot robot,
         std::optional<OccupancyView> octree, SurfaceEdges edges) {
        const OccupancyView known = octree_of(*snapshot, octree);
        const py::gil_scoped_release others_run;
        return verify_plan(plan, *snapshot, known, robot, edges);
      },
      py::arg("plan"), py::arg("snapshot"), py::arg("robot"), py::kw_only(), py::arg("octree") = py::none(),
      py::arg("edges") = SurfaceEdges{},
      "Judges every step anew, without the planner's tables: a sentence for each that is wrong; none if all "
      "is well.");
}

}  // namespace octosurf::python
