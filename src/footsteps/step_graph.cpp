#include "footsteps/step_graph.hpp"

#include "geometry/interruption.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

namespace octosurf::footsteps {
namespace {

constexpr double greedy = 4;  // weight of a search for the nearest reachable place

}  // namespace

StepGraph::StepGraph(const Gait& gait, FootholdField& field, GuideMap& guide)
    : gait_(gait),
      field_(field),
      columns_(field.columns()),
      leg_(LegBox::of(gait_.sole)),
      turns_(gait_.turns()),
      guide_(guide),
      best_(gait_.best),
      usual_(gait_.usual) {
  for (int heading = 0; heading < field_.headings(); ++heading)
    forward_.emplace_back(std::cos(field_.yaw(heading)), std::sin(field_.yaw(heading)));
}

double StepGraph::step_cost(const Place& from, const Place& to) const {
  const double climbed = to.at.z() - from.at.z();
  return 1 + gait_.costs.height * std::abs(climbed) / (climbed > 0 ? gait_.max_up_m : gait_.max_down_m) +
         to.cost;
}

bool StepGraph::climbable(const Place& from, const Place& to) const {
  const double climbed = to.at.z() - from.at.z();
  return climbed <= gait_.max_up_m && climbed >= -gait_.max_down_m;
}

const std::vector<StepEdge>& StepGraph::steps(NodeId node) {
  if (node >= steps_.size()) {
    steps_.resize(node + node / 2 + 1024);
    made_.resize(steps_.size());
  }
  if (!made_[node]) {
    std::vector<StepEdge> made;
    const NodePose from = pose(node);
    for (const Option& option : options(node, false)) {
      if (option.refusal || option.to == node) continue;
      const NodePose to = pose(option.to);
      const double cost = option.cost +
                          gait_.costs.length * (to.body.at - from.body.at).norm() / gait_.longest_m +
                          gait_.turn_cost(turn_between(from.body.yaw_rad, to.body.yaw_rad));
      made.push_back({option.to, static_cast<float>(cost), StepEdge::Collision::unchecked});
    }
    steps_[node] = std::move(made);
    made_[node] = true;
  }
  return steps_[node];
}

bool StepGraph::passable(NodeId from, std::size_t step) {
  StepEdge& edge = steps_[from][step];
  StepRefusal why{};
  if (edge.collision == StepEdge::Collision::unchecked)
    edge.collision = moves(from, edge.to, why) ? StepEdge::Collision::free : StepEdge::Collision::blocked;
  return edge.collision == StepEdge::Collision::free;
}

void StepGraph::aim(const Stance& goal) {
  goal_feet_ = goal.feet;
  goal_.clear();
  goal_body_.setZero();
  for (const NodeId node : goal.nodes) {
    goal_.push_back(pose(node));
    goal_body_ += goal_.back().body.at / static_cast<double>(goal.nodes.size());
  }
  around_goal_ = 0;
  goal_low_ = HUGE_VAL;
  goal_high_ = -HUGE_VAL;
  for (const NodePose& at : goal_) {
    around_goal_ = std::max(around_goal_, to_goal(at) + goal_radius);
    goal_low_ = std::min(goal_low_, at.ground - goal_radius);
    goal_high_ = std::max(goal_high_, at.ground + goal_radius);
  }
  best_.aim(goal_[0].heading);
  usual_.aim(goal_[0].heading);
  std::vector<GuideMap::Target> targets;
  for_each_goal_place([&](std::size_t, PlaceId id) { targets.push_back({place(id).at, place(id).surface}); });
  guide_.aim(targets);
}

bool StepGraph::in_goal(NodeId node) const {
  const NodePose at = pose(node);
  const NodePose& goal = goal_[at.foot];
  return at.heading == goal.heading && (at.body.at - goal.body.at).norm() <= goal_radius &&
         std::abs(at.ground - goal.ground) <= goal_radius;
}

bool StepGraph::at_goal(const Stance& stance) const {
  return std::all_of(stance.nodes.begin(), stance.nodes.end(), [&](NodeId node) { return in_goal(node); });
}

double StepGraph::bound(const NodePose& at) {
  if (!guideless_ && !std::isfinite(guide_.metres(place(at.place)))) return HUGE_VAL;
  double steps = 0;
  const Eigen::Vector2d way = goal_body_ - at.middle;
  for (int direction = 0; direction < FootholdField::headings(); ++direction) {
    const double metres = way.dot(forward_[direction]) - around_goal_ - gait_.off_hip_m;
    if (metres > 0 || direction == at.heading)
      steps = std::max(steps, best_.cost(at.heading, direction, metres));
  }
  if (guideless_ && !std::isfinite(steps)) steps = 0;  // it cannot turn
  return steps + gait_.costs.length * std::max(0.0, to_goal(at) - around_goal_) / gait_.longest_m +
         gait_.costs.height * std::max({0.0, (goal_low_ - at.ground) / gait_.max_up_m,
                                        (at.ground - goal_high_) / gait_.max_down_m});
}

double StepGraph::guide(NodeId node) {
  const NodePose at = pose(node);
  const double least = bound(at);
  if (guideless_) return greedy * least;
  const Place& foot = place(at.place);
  const double metres = std::max(to_goal(at) - around_goal_, guide_.metres(foot) - 2 * gait_.off_hip_m);
  const Eigen::Vector2d ahead = guide_.ahead(foot);
  const int direction = field_.nearest_heading(std::atan2(ahead.y(), ahead.x()));
  return std::max(least,
                  gait_.costs.length * metres / gait_.longest_m + usual_.cost(at.heading, direction, metres));
}

std::optional<StepRefusal> StepGraph::swing_refused(const SwingPose& from, const SwingPose& to,
                                                    double ground) const {
  geometry::end_if_interrupted();
  StepRefusal why = StepRefusal::clearance;
  for (const double height : {gait_.lift.usual, gait_.lift.high}) {
    const double low = ground + height, high = ground + std::max(height, gait_.lift.hip);
    if (!sweep_free(columns_, leg_, from, to, low, high)) continue;
    if (gait_.contact.unknown_to_m <= 0 || !field_.unknown().met(leg_, from, to, low, high)) return {};
    why = StepRefusal::unknown;
  }
  return why;
}

std::optional<StepRefusal> StepGraph::stand_refused(PlaceId id) const {
  const std::optional<ContactRefusal> why = field_.refused(id);
  if (!why) return {};
  return *why == ContactRefusal::unknown ? StepRefusal::unknown : StepRefusal::clearance;
}

Frontier StepGraph::frontier(const std::vector<NodeId>& expanded) {
  Frontier result;
  // Number of nodes nearest to the goal whose obstacles are reported.
  constexpr std::size_t looked_at = 20;
  std::vector<std::pair<double, NodeId>> near;
  for (const NodeId node : expanded) near.emplace_back(to_goal(pose(node)), node);
  const std::size_t count = std::min(looked_at, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  near.resize(count);
  if (near.empty()) return result;
  const NodePose nearest = pose(near[0].second);
  result.nearest << nearest.body.at, nearest.ground;
  result.nearest_m = near[0].first;
  const std::unordered_set<NodeId> reached(expanded.begin(), expanded.end());
  for (const auto& candidate : near) {
    const NodeId node = candidate.second;
    bool any = false;
    for (const Option& option : options(node, true)) {
      if (option.to != no_node &&
          (to_goal(pose(option.to)) >= result.nearest_m || reached.contains(option.to)))
        continue;
      StepRefusal why = option.refusal.value_or(StepRefusal::clearance);
      if (!option.refusal && moves(node, option.to, why)) continue;
      ++result.refused[static_cast<std::size_t>(why)];
      any = true;
    }
    if (!any) ++result.refused[static_cast<std::size_t>(StepRefusal::support)];
  }
  return result;
}

}  // namespace octosurf::footsteps
