#include "footsteps/step_graph.hpp"

#include "geometry/interruption.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>

namespace octosurf::footsteps {
namespace {

constexpr double greedy = 4;         // weight of a search for the nearest reachable place
constexpr double usual_share = 0.9;  // of the longest move, to estimate a whole path

}  // namespace

StepGraph::StepGraph(const Gait& gait, FootholdField& field, GuideMap& guide)
    : gait_(gait),
      field_(field),
      columns_(field.columns()),
      leg_(LegBox::of(gait_.sole)),
      turns_(static_cast<int>(gait_.max_turn_rad / field_.step_yaw() + 1e-9)),
      guide_(guide) {}

double StepGraph::step_cost(const Place& from, const Place& to) const {
  const double climbed = to.at.z() - from.at.z();
  return 1 + gait_.costs.height * std::abs(climbed) / (climbed > 0 ? gait_.max_up_m : gait_.max_down_m) +
         to.cost;
}

bool StepGraph::climbable(const Place& from, const Place& to) const {
  const double climbed = to.at.z() - from.at.z();
  return climbed <= gait_.max_up_m && climbed >= -gait_.max_down_m;
}

double StepGraph::turning(double from_rad, double to_rad, int steps) const {
  if (turns_ == 0) return 0;
  const double turn = std::abs(turn_between(from_rad, to_rad));
  return steps * turn / (turns_ * field_.step_yaw()) + gait_.costs.turn * turn / gait_.max_turn_rad;
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
                          turning(from.body.yaw_rad, to.body.yaw_rad, 0);
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
  for (const NodePose& at : goal_) around_goal_ = std::max(around_goal_, to_goal(at) + goal_radius);
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

double StepGraph::bound(const NodePose& at) const {
  const double steps = guideless_ ? 0 : guide_.steps(place(at.place));
  if (steps == std::numeric_limits<double>::infinity()) return steps;
  const double way = std::max(0.0, to_goal(at) - around_goal_);
  return std::max({gait_.least_steps * steps,
                   gait_.least_steps * way / gait_.body_step_m + gait_.costs.length * way / gait_.longest_m,
                   turning(at.body.yaw_rad, goal_[0].body.yaw_rad, gait_.least_steps)});
}

// Either it turns to the direction of the path, walks, and turns again, or it walks sideways or backward.
double StepGraph::guide(NodeId node) const {
  const NodePose at = pose(node);
  const double least = bound(at);
  if (guideless_) return greedy * least;
  const Place& foot = place(at.place);
  const double yaw = at.body.yaw_rad, last = goal_[0].body.yaw_rad;
  const double metres = std::max(to_goal(at) - around_goal_, guide_.metres(foot) - gait_.off_guide_m);
  const double way = metres / gait_.longest_m;
  const Eigen::Vector2d ahead = guide_.ahead(foot);
  const double face = ahead.norm() > 0 ? std::atan2(ahead.y(), ahead.x()) : last;
  const double walking =
      gait_.steps * way / usual_share + turning(yaw, face, gait_.steps) + turning(face, last, gait_.steps);
  const double sidling = gait_.steps * metres / gait_.sidling_m + turning(yaw, last, gait_.steps);
  return std::max(least, gait_.costs.length * way + std::min(walking, sidling));
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
