// octosurf/footsteps.hpp and plan_files.hpp in Python.
#include "map_holder.hpp"

#include <octosurf/footsteps.hpp>
#include <octosurf/plan_files.hpp>

namespace octosurf::python {
namespace {

/// The given octree, or the snapshot's own; unknown space counts as free, so none at all is refused.
OccupancyView octree_of(const Snapshot& snapshot, const std::optional<OccupancyView>& given) {
  OccupancyView octree = given.value_or(snapshot.octree);
  if (octree.resolution() == 0)
    throw Error(Error::Kind::usage, "octree", "is missing",
                "give map.octree(), or call Mapper.share_octree() first");
  return octree;
}

using SharedPlanner = Locked<FootstepPlanner>;

FootstepPlan plan_by(SharedPlanner& planner, const Standing& from, const Standing& to,
                     const PlanBudget& budget) {
  return planner.use([&](FootstepPlanner& one) { return one.plan(from, to, budget); });
}

Robot robot_in(const SnapshotPtr& snapshot, const std::optional<Robot>& given) {
  if (given) return *given;
  Biped biped;
  biped.contact.up = up_in(snapshot);
  return biped;
}

std::unique_ptr<SharedPlanner> planner_of(const SnapshotPtr& snapshot, const std::optional<Robot>& robot,
                                          const std::optional<OccupancyView>& octree) {
  const py::gil_scoped_release others_run;
  return std::make_unique<SharedPlanner>(snapshot, octree_of(*snapshot, octree), robot_in(snapshot, robot));
}

void bind_settings(Module& module) {
  Settings<BodyBox>(module, "BodyBox").fields(OCTOSURF_FIELDS(BodyBox, length_m, width_m, from_m, to_m));
  Settings<StepCosts>(module, "StepCosts")
      .fields(OCTOSURF_FIELDS(StepCosts, length, height, turn, margin, slope, uncertainty, good_margin_m,
                              uncertain_m));
  Settings<PlanBudget>(module, "PlanBudget")
      .fields(OCTOSURF_FIELDS(PlanBudget, expansions, improving, time_s));
  Settings<Standing>(module, "Standing").fields(OCTOSURF_FIELDS(Standing, at, yaw_rad));
}

/// What both robots have.
template <class R>
Settings<R> robot_class(Module& module, const char* name) {
  Settings<R> robot(module, name);
  robot
      .fields(OCTOSURF_FIELDS(R, foot, contact, stance_width_m, max_up_m, max_down_m, max_turn_rad, lift_m,
                              high_lift_m, body, costs))
      .def("validate", &R::validate)
      .def_static("limits", &R::limits);
  return robot;
}

void bind_plan(Module& module) {
  Value<Footstep>(module, "Footstep")
      .fields(OCTOSURF_FIELDS(Footstep, foot, surface, T_map_foot, yaw_rad, margin_m));
  Value<NoPlan>(module, "NoPlan")
      .fields(OCTOSURF_FIELDS(NoPlan, why, sentence, contact, nearest, nearest_m))
      .field("refused", &NoPlan::refused, step_refusal_names);
  using P = FootstepPlan;
  Value<P>(module, "FootstepPlan")
      .fields(OCTOSURF_FIELDS(P, start, steps, body, cost, lower_bound, expansions, search_ms, refusal))
      .def_property_readonly("found", &P::found, doc_of("FootstepPlan.found"))
      .def("to_json", &to_json, "robot"_a, R"(A JSON object, "octosurf-plan" of docs/formats.md; degrees.)")
      .def("__bool__", &P::found, "found.");
}

}  // namespace

void bind_footsteps(Module& module) {
  bind_settings(module);
  robot_class<Biped>(module, "Biped")
      .fields(OCTOSURF_FIELDS(Biped, max_forward_m, max_backward_m, min_width_m, max_width_m));
  robot_class<Quadruped>(module, "Quadruped")
      .fields(OCTOSURF_FIELDS(Quadruped, stance_length_m, max_step_m, max_sideward_m, reach_m, snap_m,
                              max_sway_m, support_margin_m));
  bind_plan(module);
  Class<SharedPlanner>(module, "FootstepPlanner", R"(Plans footsteps over the surfaces of one snapshot.

Footholds are accepted by foothold(); swinging feet and body touch no occupied voxel, unknown space counts as free. Statics
only. Deterministic without a time limit. What it finds out about the map it keeps for later plans.)")
      .def(py::init([](const SnapshotPtr& snapshot, const OccupancyView& octree, const Robot& robot) {
             return planner_of(snapshot, robot, octree);
           }),
           "snapshot"_a, "octree"_a, "robot"_a)
      .def(
          py::init(&planner_of), "snapshot"_a, "robot"_a = py::none(), py::kw_only(), "octree"_a = py::none(),
          R"(robot: Biped or Quadruped; None: Biped() with the map's up. octree: OccupancyView; None: the snapshot's own.
Throws Error(usage).)")
      .def(
          "next",
          [](SharedPlanner& self, const SnapshotPtr& snapshot, const std::optional<OccupancyView>& octree) {
            return self.use([&](FootstepPlanner& one) {
              return std::make_unique<SharedPlanner>(one.next(snapshot, octree_of(*snapshot, octree)));
            });
          },
          "snapshot"_a, "octree"_a = py::none(),
          "A planner for a later Snapshot of the same map, which keeps what is as it was.")
      .def("plan", &plan_by, "from_"_a, "to"_a, "budget"_a = PlanBudget{});
  module.def(
      "plan",
      [](const SnapshotPtr& snapshot, const OccupancyView& octree, const Robot& robot, const Standing& from,
         const Standing& to, const PlanBudget& budget) {
        return plan_by(*planner_of(snapshot, robot, octree), from, to, budget);
      },
      "snapshot"_a, "octree"_a, "robot"_a, "from_"_a, "to"_a, "budget"_a = PlanBudget{},
      "FootstepPlanner(snapshot, octree, robot).plan(from_, to, budget), for a single plan.");
  module.def(
      "plan",
      [](const SnapshotPtr& snapshot, const Standing& from, const Standing& to,
         const std::optional<Robot>& robot, const PlanBudget& budget,
         const std::optional<OccupancyView>& octree) {
        return plan_by(*planner_of(snapshot, robot, octree), from, to, budget);
      },
      "snapshot"_a, "from_"_a, "to"_a, "robot"_a = py::none(), "budget"_a = PlanBudget{}, py::kw_only(),
      "octree"_a = py::none(),
      "The same; robot None: Biped() with the map's up; octree None: the snapshot's own.");
}

}  // namespace octosurf::python
