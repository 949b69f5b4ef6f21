#include "planning/footsteps/quadruped_graph.hpp"
#include "planning/footsteps/robot_planner.hpp"

#include <cmath>
#include <utility>

namespace octosurf::footsteps {
namespace {

// A foot moves as far as the body, plus the width of its search area.
GuideMap::Reach reach_of(const Quadruped& robot) {
  const double turned =
      2 * std::sin(robot.max_turn_rad / 2) * std::hypot(robot.stance_length_m, robot.stance_width_m) / 2;
  const double rounded = 0.1;  // the body's grid
  return {std::hypot(robot.max_step_m, robot.max_sideward_m) + turned + 2 * robot.snap_m + rounded,
          robot.max_up_m, robot.max_down_m};
}

FootName leg_name(std::size_t leg) {
  return static_cast<FootName>(static_cast<std::size_t>(FootName::front_left) + leg);
}

class QuadrupedPlanner : public RobotPlanner {
 public:
  QuadrupedPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const Quadruped& robot,
                   std::map<SurfaceId, std::vector<PolygonEdges>> edges)
      : RobotPlanner(std::move(snapshot), std::move(octree), kind_of(robot), std::move(edges)),
        robot_(robot),
        graph_(robot_, ground_, guide_) {}

 private:
  static Kind kind_of(const Quadruped& robot) {
    return {.foot = robot.foot,
            .contact = robot.contact,
            .costs = robot.costs,
            .body = robot.body,
            .headings = 1,
            .headroom_m = robot.body.to_m + robot.max_up_m,
            .disc_radius_m = robot.foot.radius,
            .reach = reach_of(robot)};
  }

  void search(const Standing& from, const Standing& to, const PlanBudget& budget,
              FootstepPlan& plan) override {
    const auto start = graph_.stance(from);
    if (!start) {
      plan.refusal = refused_stance(NoPlan::Why::start, from);
      return;
    }
    const auto goal = graph_.stance(to);
    if (!goal) {
      plan.refusal = refused_stance(NoPlan::Why::goal, to);
      return;
    }
    graph_.aim(*goal);
    for (std::size_t leg = 0; leg < 4; ++leg)
      plan.start.push_back(footstep(leg, graph_.feet_of(*start)[leg], graph_.body_of(*start).yaw_rad));
    plan.body.push_back(standing(graph_.body_of(*start), graph_.ground_of(*start)));
    if (graph_.at_goal(*start)) return;
    AnytimeSearch search(graph_, {*start}, budget);
    const SearchOutcome& found = search.run();
    plan.expansions = found.expansions;
    if (found.path.empty()) {
      plan.refusal = refusal_of(ground_, frontier(found, *start, search.left()),
                                found.exhausted ? Ending::start_exhausted : Ending::budget, found.expansions);
      return;
    }
    plan.cost = found.cost;
    plan.lower_bound = found.lower_bound;
    for (std::size_t i = 1; i < found.path.size(); ++i) {
      const auto steps = graph_.crawl(found.path[i - 1], found.path[i]);
      for (const CrawlStep& step : *steps) {
        plan.steps.push_back(footstep(step.leg, step.to, step.body.yaw_rad));
        plan.body.push_back(standing(step.body, step.ground));
      }
    }
  }

  Frontier frontier(const SearchOutcome& found, NodeId start, PlanBudget left) {
    if (!found.expanded.empty()) return graph_.frontier(found.expanded);
    graph_.ignore_guide(true);
    left.expansions = std::min<std::size_t>(left.expansions, 2000);
    const SearchOutcome blind = AnytimeSearch(graph_, {start}, left).run();
    graph_.ignore_guide(false);
    return graph_.frontier(blind.expanded);
  }

  NoPlan refused_stance(NoPlan::Why why, const Standing& at) {
    std::vector<std::pair<FootName, Eigen::Vector3d>> wanted;
    for (std::size_t leg = 0; leg < 4; ++leg) {
      const Eigen::Vector2d below = graph_.hip({at.at.head<2>(), at.yaw_rad}, leg);
      wanted.emplace_back(leg_name(leg), Eigen::Vector3d(below.x(), below.y(), at.at.z()));
    }
    return refusal_of(ground_, why, wanted, at, 0,
                      [&](const Standing& there) { return graph_.stance(there).has_value(); });
  }

  Footstep footstep(std::size_t leg, PlaceId id, double yaw_rad) const {
    return ground_.footstep(leg_name(leg), graph_.place(id), yaw_rad);
  }

  Standing standing(const SwingPose& body, double z) const {
    return ground_.to_map({{body.at.x(), body.at.y(), z}, body.yaw_rad});
  }

  Quadruped robot_;
  QuadrupedGraph graph_;
};

}  // namespace

std::unique_ptr<RobotPlanner> make_quadruped_planner(std::shared_ptr<const Snapshot> snapshot,
                                                     OccupancyView octree, const Quadruped& robot,
                                                     std::map<SurfaceId, std::vector<PolygonEdges>> edges) {
  return std::make_unique<QuadrupedPlanner>(std::move(snapshot), std::move(octree), robot, std::move(edges));
}

}  // namespace octosurf::footsteps
