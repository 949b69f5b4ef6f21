#include "footsteps/step_graph.hpp"

#include <chrono>
#include <cmath>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf {
namespace {

using namespace footsteps;

constexpr std::size_t first_expansions = 1500;  // several times the need of plans across a room
constexpr std::size_t blind_expansions = 600;   // to find the nearest reachable place to an unreachable goal
constexpr std::size_t backward_nodes = 4000;    // more than the poses on a tread or a table

void require_sensible(const Standing& standing, const char* name) {
  if (!standing.at.allFinite() || !std::isfinite(standing.yaw_rad))
    throw Error(Error::Kind::usage, name, "is not finite", "give X Y Z and a heading");
}

Gait valid_gait(const Robot& robot) {
  return std::visit(
      [](const auto& kind) {
        kind.validate();
        return gait_of(kind);
      },
      robot);
}

}  // namespace

struct FootstepPlanner::Impl {
  Robot robot;
  Gait gait;
  FootholdField field;
  GuideMap guide;
  std::unique_ptr<StepGraph> graph;

  Impl(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const Robot& of, const Impl* before)
      : robot(of),
        gait(valid_gait(robot)),
        field(std::move(snapshot), std::move(octree), gait, before != nullptr ? &before->field : nullptr),
        guide(field, gait),
        graph(std::visit([&](const auto& kind) { return graph_of(kind, gait, field, guide); }, robot)) {}

  /// All but a plan's times; in the walking frame.
  void search(const Standing& from, const Standing& to, const PlanBudget& budget, FootstepPlan& plan) {
    const StepGraph::Stance start = graph->stance(from);
    if (start.nodes.empty()) {
      plan.refusal = refused_stance(NoPlan::Why::start, from);
      return;
    }
    const StepGraph::Stance goal = graph->stance(to);
    if (goal.nodes.empty()) {
      plan.refusal = refused_stance(NoPlan::Why::goal, to);
      return;
    }
    graph->aim(goal);
    const StepGraph::NodePose first = graph->pose(start.nodes[0]);
    for (std::size_t foot = 0; foot < start.feet.size(); ++foot)
      plan.start.push_back(footstep(foot, start.feet[foot], first.body));
    plan.body.push_back(standing(first.body, first.ground));
    if (graph->at_goal(start)) return;
    // Most plans are found soon. Otherwise a backward search checks whether anything leads to the goal before
    // the rest of the budget is used.
    AnytimeSearch<StepGraph> search(*graph, start.nodes, budget);
    const bool cut_off =
        !search.find(first_expansions) && graph->goal_is_cut_off(start.nodes, backward_nodes);
    const SearchOutcome& found = cut_off ? search.so_far() : search.run();
    plan.expansions = found.expansions;
    if (found.path.empty()) {
      const Ending ending = found.exhausted ? Ending::start_exhausted
                            : cut_off       ? Ending::goal_cut_off
                                            : Ending::budget;
      plan.refusal = refusal_of(field, frontier(found, start.nodes, search.left()), ending, found.expansions);
      return;
    }
    const StepGraph::NodePose begin = graph->pose(found.path.front());
    plan.body.front() = standing(begin.body, begin.ground);
    plan.cost = found.cost;
    plan.lower_bound = found.lower_bound;
    StepRefusal why{};
    for (std::size_t i = 1; i < found.path.size(); ++i) {
      const StepGraph::Moves moves = graph->moves(found.path[i - 1], found.path[i], why);
      for (const StepGraph::FootMove& move : *moves) {
        plan.steps.push_back(footstep(move.foot, move.to, move.body));
        plan.body.push_back(standing(move.body, move.ground));
      }
    }
  }

  // If the guide has no path, nothing was expanded: a search without it finds the nearest reachable place.
  Frontier frontier(const SearchOutcome& found, const std::vector<NodeId>& starts, PlanBudget left) {
    if (!found.expanded.empty()) return graph->frontier(found.expanded);
    graph->ignore_guide(true);
    left.expansions = std::min(left.expansions, blind_expansions);
    const SearchOutcome blind = AnytimeSearch<StepGraph>(*graph, starts, left).run();
    graph->ignore_guide(false);
    return graph->frontier(blind.expanded);
  }

  NoPlan refused_stance(NoPlan::Why why, Standing at) {
    at.yaw_rad = field.yaw(field.nearest_heading(at.yaw_rad));
    return refusal_of(field, why, gait.feet, at,
                      [&](const Standing& there) { return !graph->stance(there).nodes.empty(); });
  }

  Footstep footstep(std::size_t foot, PlaceId id, const SwingPose& body) const {
    return field.footstep(gait.feet[foot].name, field.place(id), body.yaw_rad);
  }
  Standing standing(const SwingPose& body, double z) const {
    return field.to_map({{body.at.x(), body.at.y(), z}, body.yaw_rad});
  }
};

FootstepPlanner::FootstepPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, Robot robot)
    : impl_(std::make_unique<Impl>(std::move(snapshot), std::move(octree), robot, nullptr)) {}

FootstepPlanner::FootstepPlanner(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

FootstepPlanner FootstepPlanner::next(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree) const {
  return FootstepPlanner(
      std::make_unique<Impl>(std::move(snapshot), std::move(octree), impl_->robot, impl_.get()));
}

FootstepPlanner::FootstepPlanner(FootstepPlanner&&) noexcept = default;
FootstepPlanner& FootstepPlanner::operator=(FootstepPlanner&&) noexcept = default;
FootstepPlanner::~FootstepPlanner() = default;

FootstepPlan FootstepPlanner::plan(const Standing& from, const Standing& to, const PlanBudget& budget) {
  require_sensible(from, "from");
  require_sensible(to, "to");
  if (budget.time_s && !(*budget.time_s >= 0))
    throw Error(Error::Kind::usage, "time_s", "is not a time", "give seconds, or leave it empty");
  const auto start = std::chrono::steady_clock::now();
  FootstepPlan plan;
  impl_->search(impl_->field.to_walk(from), impl_->field.to_walk(to), budget, plan);
  plan.search_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return plan;
}

}  // namespace octosurf
