#include "planning/footsteps/biped_graph.hpp"
#include "planning/footsteps/robot_planner.hpp"

#include <cmath>
#include <memory>
#include <utility>

namespace octosurf::footsteps {
namespace {

constexpr std::size_t first_expansions = 1500;  // several times the need of plans across a room
constexpr std::size_t blind_expansions = 600;   // to find the nearest reachable place to an unreachable goal
constexpr std::size_t backward_nodes = 4000;    // more than the poses on a tread or a table
constexpr int biped_headings = 16;              // 22.5° each: one a step, with the usual limit of 25°

// The largest disc about the reference point inside a sole.
double disc_in(const ContactShape& shape) {
  if (shape.outline.empty()) return shape.radius;
  double radius = HUGE_VAL;
  for (std::size_t i = 0; i < shape.outline.size(); ++i) {
    const Eigen::Vector2d &a = shape.outline[i], &b = shape.outline[(i + 1) % shape.outline.size()];
    const Eigen::Vector2d edge = (b - a).normalized();
    radius = std::min(radius, edge.y() * a.x() - edge.x() * a.y());
  }
  return std::max(0.0, radius);
}

GuideMap::Reach reach_of(const Biped& robot) {
  return {std::hypot(std::max(robot.max_forward_m, robot.max_backward_m), robot.max_width_m), robot.max_up_m,
          robot.max_down_m};
}

// Half the side of the square that contains the body over a foot in any heading: the body's middle is half a
// stance beside it.
double trunk_reach(const Biped& robot) {
  const double inscribed = std::min(robot.body.length_m, robot.body.width_m - robot.stance_width_m) / 2;
  return std::max(0.0, inscribed / std::sqrt(2.0) - GuideMap::slack_m);
}

FootName side_name(int side) { return side == 0 ? FootName::left : FootName::right; }

class BipedPlanner : public RobotPlanner {
 public:
  BipedPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const Biped& robot,
               std::map<SurfaceId, std::vector<PolygonEdges>> edges)
      : RobotPlanner(std::move(snapshot), std::move(octree), kind_of(robot), std::move(edges)),
        robot_(robot),
        graph_(robot_, ground_.field, ground_.columns, guide_) {}

 private:
  static Kind kind_of(const Biped& robot) {
    return {.foot = robot.foot,
            .contact = robot.contact,
            .costs = robot.costs,
            .body = robot.body,
            .headings = biped_headings,
            .headroom_m = robot.body.to_m + robot.max_up_m,
            .disc_radius_m = disc_in(robot.foot),
            .trunk_reach_m = trunk_reach(robot),
            .reach = reach_of(robot)};
  }

  void search(const Standing& from, const Standing& to, const PlanBudget& budget,
              FootstepPlan& plan) override {
    const int from_heading = ground_.field.nearest_heading(from.yaw_rad),
              to_heading = ground_.field.nearest_heading(to.yaw_rad);
    const std::vector<PlaceId> feet = graph_.stance(from.at, from_heading);
    if (feet.empty()) {
      plan.refusal = refused_stance(NoPlan::Why::start, from.at, from_heading);
      return;
    }
    const std::vector<PlaceId> goal = graph_.stance(to.at, to_heading);
    if (goal.empty()) {
      plan.refusal = refused_stance(NoPlan::Why::goal, to.at, to_heading);
      return;
    }
    graph_.aim(to.at, goal);
    const std::vector<NodeId> starts{graph_.node_of(feet[0], 0), graph_.node_of(feet[1], 1)};
    for (const NodeId node : starts) plan.start.push_back(footstep(node));
    plan.body.push_back(body_over(starts[0]));
    if (graph_.at_goal(feet)) return;
    // Most plans are found soon. Otherwise a backward search checks whether anything leads to the goal before
    // the rest of the budget is used.
    AnytimeSearch search(graph_, starts, budget);
    const bool cut_off = !search.find(first_expansions) && graph_.goal_is_cut_off(starts, backward_nodes);
    const SearchOutcome& found = cut_off ? search.so_far() : search.run();
    plan.expansions = found.expansions;
    if (found.path.empty()) {
      const Ending ending = found.exhausted ? Ending::start_exhausted
                            : cut_off       ? Ending::goal_cut_off
                                            : Ending::budget;
      plan.refusal = refusal_of(ground_, frontier(found, starts, search.left()), ending, found.expansions);
      return;
    }
    plan.body.front() = body_over(found.path.front());
    plan.cost = found.cost;
    plan.lower_bound = found.lower_bound;
    for (std::size_t i = 1; i < found.path.size(); ++i) {
      plan.steps.push_back(footstep(found.path[i]));
      plan.body.push_back(body_over(found.path[i]));
    }
  }

  // If the guide has no path, nothing was expanded: a search without it finds the nearest reachable place.
  Frontier frontier(const SearchOutcome& found, const std::vector<NodeId>& starts, PlanBudget left) {
    if (!found.expanded.empty()) return graph_.frontier(found.expanded);
    graph_.ignore_guide(true);
    left.expansions = std::min(left.expansions, blind_expansions);
    const SearchOutcome blind = AnytimeSearch(graph_, starts, left).run();
    graph_.ignore_guide(false);
    return graph_.frontier(blind.expanded);
  }

  NoPlan refused_stance(NoPlan::Why why, const Eigen::Vector3d& at, int heading) {
    const double yaw = ground_.field.yaw(heading);
    const Eigen::Vector3d left(-std::sin(yaw), std::cos(yaw), 0);
    const double half = robot_.stance_width_m / 2;
    return refusal_of(ground_, why, {{FootName::left, at + half * left}, {FootName::right, at - half * left}},
                      {at, yaw}, heading,
                      [&](const Standing& there) { return !graph_.stance(there.at, heading).empty(); });
  }

  Footstep footstep(NodeId node) const {
    const Place& place = graph_.place(node);
    return ground_.footstep(side_name(BipedGraph::side_of(node)), place, ground_.field.yaw(place.heading));
  }

  Standing body_over(NodeId node) const {
    const Place& place = graph_.place(node);
    const Eigen::Vector2d at = graph_.body_at(node);
    return ground_.to_map({{at.x(), at.y(), place.at.z()}, ground_.field.yaw(place.heading)});
  }

  Biped robot_;
  BipedGraph graph_;
};

}  // namespace

std::unique_ptr<RobotPlanner> make_biped_planner(std::shared_ptr<const Snapshot> snapshot,
                                                 OccupancyView octree, const Biped& robot,
                                                 std::map<SurfaceId, std::vector<PolygonEdges>> edges) {
  return std::make_unique<BipedPlanner>(std::move(snapshot), std::move(octree), robot, std::move(edges));
}

}  // namespace octosurf::footsteps
