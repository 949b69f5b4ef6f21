#include "planning/footsteps/biped_graph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace octosurf::footsteps {
namespace {

// m around the given place in which feet are placed: a cell and its neighbours, to find a foothold beside a
// ridge, within the accuracy of a robot's odometry.
constexpr double stance_radius = 0.10;
constexpr double biped_stance_height = 0.20;  // m off the given height, which may be approximate
constexpr double between_soles = 0.02;        // m, level
constexpr double greedy = 4;                  // weight of a search for the nearest reachable place
constexpr double sidling_step = 0.12;         // m, of a step sideways or backward
constexpr double usual_share = 0.9;           // of the longest step, to estimate a whole path

Eigen::Vector2d left_of(const Eigen::Vector2d& forward) { return {-forward.y(), forward.x()}; }

// Whether the soles, projected level, are on opposite sides of a strip `between_soles` wide.
bool apart_along(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                 const Eigen::Vector2d& axis) {
  double a_min = HUGE_VAL, a_max = -HUGE_VAL, b_min = HUGE_VAL, b_max = -HUGE_VAL;
  for (const Eigen::Vector2d& p : a)
    a_min = std::min(a_min, axis.dot(p)), a_max = std::max(a_max, axis.dot(p));
  for (const Eigen::Vector2d& p : b)
    b_min = std::min(b_min, axis.dot(p)), b_max = std::max(b_max, axis.dot(p));
  return std::max(a_min - b_max, b_min - a_max) >= between_soles;
}

}  // namespace

BipedGraph::BipedGraph(const Biped& robot, FootholdField& field, ObstacleColumns& columns, GuideMap& guide)
    : robot_(robot), field_(field), columns_(columns), guide_(guide), leg_(LegBox::of(robot.foot)) {
  for (int heading = 0; heading < field.headings(); ++heading)
    forward_.emplace_back(std::cos(field.yaw(heading)), std::sin(field.yaw(heading)));
  turns_ = static_cast<int>(robot.max_turn_rad / field.step_yaw() + 1e-9);
  const double half = robot.stance_width_m / 2, turn = turns_ * field.step_yaw();
  body_step_ = std::hypot(
      std::max(robot.max_forward_m, robot.max_backward_m) + half * std::sin(turn),
      std::max(robot.max_width_m - robot.stance_width_m, robot.stance_width_m - robot.min_width_m) +
          half * (1 - std::cos(turn)));
}

Eigen::Vector2d BipedGraph::body_at(NodeId node) const {
  const Place& at = place(node);
  const double inward = side_of(node) == 0 ? -1 : 1;
  return at.at.head<2>() + inward * robot_.stance_width_m / 2 * left_of(forward_[at.heading]);
}

SwingPose BipedGraph::beside(NodeId standing) const {
  const Place& at = place(standing);
  const double inward = side_of(standing) == 0 ? -1 : 1;
  return {at.at.head<2>() + inward * robot_.stance_width_m * left_of(forward_[at.heading]),
          field_.yaw(at.heading)};
}

BipedGraph::Offset BipedGraph::offset(NodeId from, const Place& to) const {
  const Place& at = place(from);
  const Eigen::Vector2d& forward = forward_[at.heading];
  const Eigen::Vector2d d = to.at.head<2>() - at.at.head<2>();
  const double left = left_of(forward).dot(d);
  return {forward.dot(d), side_of(from) == 0 ? -left : left};
}

bool BipedGraph::in_reach(const Offset& offset) const {
  return offset.forward <= robot_.max_forward_m && offset.forward >= -robot_.max_backward_m &&
         offset.outward >= robot_.min_width_m && offset.outward <= robot_.max_width_m;
}

double BipedGraph::cost(NodeId from, NodeId to) const {
  const StepCosts& costs = robot_.costs;
  const Place &a = place(from), &b = place(to);
  const double moved = (body_at(to) - body_at(from)).norm();
  const double turned = std::abs(turn_between(field_.yaw(a.heading), field_.yaw(b.heading)));
  const double climbed = b.at.z() - a.at.z();
  return 1 + costs.length * moved / robot_.max_forward_m + costs.turn * turned / robot_.max_turn_rad +
         costs.height * std::abs(climbed) / (climbed > 0 ? robot_.max_up_m : robot_.max_down_m) + b.cost;
}

Eigen::AlignedBox2d BipedGraph::window(NodeId node, double times) const {
  const Place& at = place(node);
  const double outward = side_of(node) == 0 ? -1 : 1;
  const Eigen::Vector2d& forward = forward_[at.heading];
  Eigen::AlignedBox2d box;
  for (const double f : {-times * robot_.max_backward_m, times * robot_.max_forward_m})
    for (const double w :
         {times > 1 ? -times * robot_.max_width_m : robot_.min_width_m, times * robot_.max_width_m})
      box.extend(at.at.head<2>() + f * forward + outward * w * left_of(forward));
  return box;
}

const std::vector<StepEdge>& BipedGraph::steps(NodeId node) {
  if (node >= steps_.size()) {
    steps_.resize(node + node / 2 + 1024);
    made_.resize(steps_.size());
  }
  if (!made_[node]) {
    std::vector<StepEdge> made;
    make_steps(node, made);
    steps_[node] = std::move(made);
    made_[node] = true;
  }
  return steps_[node];
}

void BipedGraph::make_steps(NodeId node, std::vector<StepEdge>& made) {
  const int ahead = place(node).heading;
  const Eigen::AlignedBox2d box = window(node, 1);
  for (int turn = -turns_; turn <= turns_; ++turn) {
    const int heading = (ahead + turn + field_.headings()) % field_.headings();
    field_.for_each_place(heading, box, [&](PlaceId id) {
      const NodeId other = node_of(id, 1 - side_of(node));
      if (!step_allowed(node, other)) return;
      made.push_back({other, static_cast<float>(cost(node, other)), StepEdge::Collision::unchecked});
    });
  }
}

bool BipedGraph::step_allowed(NodeId from, NodeId to) const {
  const double climbed = place(to).at.z() - place(from).at.z();
  return climbed <= robot_.max_up_m && climbed >= -robot_.max_down_m && in_reach(offset(from, place(to)));
}

std::vector<NodeId> BipedGraph::predecessors(NodeId node) {
  const Place to = place(node);
  const double reach = std::hypot(std::max(robot_.max_forward_m, robot_.max_backward_m), robot_.max_width_m);
  const Eigen::Vector2d r(reach, reach);
  const Eigen::AlignedBox2d box(to.at.head<2>() - r, to.at.head<2>() + r);
  std::vector<NodeId> result;
  for (int turn = -turns_; turn <= turns_; ++turn) {
    const int heading = (to.heading + turn + field_.headings()) % field_.headings();
    field_.for_each_place(heading, box, [&](PlaceId id) {
      const NodeId from = node_of(id, 1 - side_of(node));
      if (step_allowed(from, node)) result.push_back(from);
    });
  }
  return result;
}

bool BipedGraph::goal_is_cut_off(const std::vector<NodeId>& starts, std::size_t most) {
  std::unordered_set<NodeId> reached;
  std::vector<std::pair<NodeId, NodeId>> open;  // a node, and one it leads to; the last is processed first
  const auto add = [&](NodeId node) {
    reached.insert(node);
    for (const NodeId from : predecessors(node))
      if (!reached.contains(from)) open.emplace_back(from, node);
  };
  // The last step ends with both feet at the goal.
  for (const NodeId end : goal_)
    for (const NodeId from : predecessors(end))
      if (goal_.contains(from)) open.emplace_back(from, end);
  while (!open.empty() && reached.size() < most) {
    const auto [from, to] = open.back();
    open.pop_back();
    if (reached.contains(from) || !way_free(from, to)) continue;
    if (std::find(starts.begin(), starts.end(), from) != starts.end()) return false;
    add(from);
  }
  return open.empty();
}

bool BipedGraph::passable(NodeId from, std::size_t step) {
  StepEdge& edge = steps_[from][step];
  if (edge.collision == StepEdge::Collision::unchecked)
    edge.collision = way_free(from, edge.to) ? StepEdge::Collision::free : StepEdge::Collision::blocked;
  return edge.collision == StepEdge::Collision::free;
}

bool BipedGraph::way_free(NodeId from, NodeId to) {
  const Place &a = place(from), &b = place(to);
  if (!soles_apart(a, b)) return false;
  const double high = std::max(a.at.z(), b.at.z());
  const Lift lift{robot_.lift_m, robot_.high_lift_m, robot_.body.from_m};
  return swing_free(columns_, leg_, beside(from), pose(b), high, lift) &&
         swing_free(columns_, leg_, pose(a), beside(to), high, lift) && body_free(from, to) &&
         field_.stands(place_of(to));  // last: slowest, some 40 µs
}

bool BipedGraph::body_free(NodeId from, NodeId to) {
  const Place &a = place(from), &b = place(to);
  return body_sweep_free(columns_, robot_.body, {body_at(from), field_.yaw(a.heading)}, a.at.z(),
                         {body_at(to), field_.yaw(b.heading)}, b.at.z());
}

bool BipedGraph::soles_apart(const Place& a, const Place& b) const {
  const Eigen::Vector2d d = b.at.head<2>() - a.at.head<2>();
  if (robot_.foot.outline.empty()) return d.norm() >= 2 * robot_.foot.radius + between_soles;
  if (d.norm() >= 2 * robot_.foot.reach() + between_soles) return true;
  const auto outline = [&](const Place& place) {
    const Eigen::Rotation2Dd turn(field_.yaw(place.heading));
    std::vector<Eigen::Vector2d> result;
    for (const Eigen::Vector2d& p : robot_.foot.outline) result.push_back(place.at.head<2>() + turn * p);
    return result;
  };
  const std::vector<Eigen::Vector2d> left = outline(a), right = outline(b);
  for (const auto* ring : {&left, &right}) {
    for (std::size_t i = 0; i < ring->size(); ++i) {
      const Eigen::Vector2d edge = (*ring)[(i + 1) % ring->size()] - (*ring)[i];
      if (apart_along(left, right, Eigen::Vector2d(edge.y(), -edge.x()).normalized())) return true;
    }
  }
  return false;
}

std::vector<PlaceId> BipedGraph::stance(const Eigen::Vector3d& at, int heading) {
  const Eigen::Vector2d left_of_body = left_of(forward_[static_cast<std::size_t>(heading)]);
  struct Candidate {
    double squared;
    PlaceId id;
  };
  std::array<std::vector<Candidate>, 2> candidates;
  for (int side = 0; side < 2; ++side) {
    const Eigen::Vector2d nominal =
        at.head<2>() + (side == 0 ? 1 : -1) * robot_.stance_width_m / 2 * left_of_body;
    const Eigen::Vector2d r(stance_radius, stance_radius);
    field_.for_each_place(heading, {nominal - r, nominal + r}, [&](PlaceId id) {
      const Eigen::Vector3d& p = field_.place(id).at;
      const double squared = (p.head<2>() - nominal).squaredNorm();
      if (squared > stance_radius * stance_radius || std::abs(p.z() - at.z()) > biped_stance_height) return;
      const double off = p.z() - at.z();
      candidates[static_cast<std::size_t>(side)].push_back({squared + off * off, id});
    });
    std::stable_sort(candidates[static_cast<std::size_t>(side)].begin(),
                     candidates[static_cast<std::size_t>(side)].end(),
                     [](const Candidate& a, const Candidate& b) { return a.squared < b.squared; });
  }
  std::vector<PlaceId> best;
  double least = HUGE_VAL;
  for (const Candidate& left : candidates[0]) {
    for (const Candidate& right : candidates[1]) {
      if (left.squared + right.squared >= least) break;
      const NodeId a = node_of(left.id, 0), b = node_of(right.id, 1);
      if (!in_reach(offset(a, place(b))) || !way_free(a, b) || !way_free(b, a)) continue;
      if (std::abs(place(a).at.z() - place(b).at.z()) > std::min(robot_.max_up_m, robot_.max_down_m))
        continue;
      least = left.squared + right.squared;
      best = {left.id, right.id};
    }
  }
  return best;
}

void BipedGraph::aim(const Eigen::Vector3d& at, const std::vector<PlaceId>& feet) {
  goal_.clear();
  goal_body_ = at.head<2>();
  goal_radius_ = 0;
  goal_heading_ = field_.place(feet[0]).heading;
  std::vector<GuideMap::Target> targets;
  for (int side = 0; side < 2; ++side) {
    const Eigen::Vector3d middle = field_.place(feet[static_cast<std::size_t>(side)]).at;
    const Eigen::Vector2d r(stance_radius, stance_radius);
    const Eigen::Vector2d low = middle.head<2>() - r, high = middle.head<2>() + r;
    field_.for_each_place(goal_heading_, {low, high}, [&](PlaceId id) {
      const Place& p = field_.place(id);
      if ((p.at - middle).norm() > stance_radius) return;
      const NodeId node = node_of(id, side);
      goal_.insert(node);
      goal_radius_ = std::max(goal_radius_, (body_at(node) - goal_body_).norm());
      targets.push_back({p.at, p.surface});
    });
  }
  guide_.aim(targets);
}

bool BipedGraph::at_goal(const std::vector<PlaceId>& feet) const {
  return goal_.contains(node_of(feet[0], 0)) && goal_.contains(node_of(feet[1], 1));
}

double BipedGraph::bound(NodeId node) const {
  const Place& at = place(node);
  const double steps = guideless_ ? 0 : guide_.steps(at);
  if (steps == std::numeric_limits<double>::infinity()) return steps;
  const double way = std::max(0.0, (body_at(node) - goal_body_).norm() - goal_radius_);
  const double turn = std::abs(turn_between(field_.yaw(at.heading), field_.yaw(goal_heading_)));
  const double by_turn =
      turns_ == 0 ? 0 : turn / (turns_ * field_.step_yaw()) + robot_.costs.turn * turn / robot_.max_turn_rad;
  return std::max({steps, way / body_step_ + robot_.costs.length * way / robot_.max_forward_m, by_turn});
}

// Either it turns to the direction of the path, walks, and turns again, or it walks sideways or backward.
double BipedGraph::guide(NodeId node) const {
  const Place& at = place(node);
  if (guideless_) return greedy * bound(node);
  const double yaw = field_.yaw(at.heading), last = field_.yaw(goal_heading_);
  const auto turning = [&](double from, double to) {
    const double turn = std::abs(turn_between(from, to));
    return turns_ == 0 ? 0
                       : turn / (turns_ * field_.step_yaw()) + robot_.costs.turn * turn / robot_.max_turn_rad;
  };
  const double metres = guide_.metres(at), way = metres / robot_.max_forward_m;
  const Eigen::Vector2d ahead = guide_.ahead(at);
  const double face = ahead.norm() > 0 ? std::atan2(ahead.y(), ahead.x()) : last;
  const double walking =
      way / usual_share + robot_.costs.length * way + turning(yaw, face) + turning(face, last);
  const double sidling = metres / sidling_step + robot_.costs.length * way + turning(yaw, last);
  return std::max(bound(node), std::min(walking, sidling));
}

Frontier BipedGraph::frontier(const std::vector<NodeId>& expanded) {
  Frontier result;
  // Number of nodes nearest to the goal whose obstacles are reported.
  constexpr std::size_t looked_at = 20;
  std::vector<std::pair<double, NodeId>> near;
  for (const NodeId node : expanded) near.emplace_back((body_at(node) - goal_body_).norm(), node);
  const std::size_t count = std::min(looked_at, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  near.resize(count);
  if (near.empty()) return result;
  result.nearest = place(near[0].second).at;
  result.nearest.head<2>() = body_at(near[0].second);
  result.nearest_m = near[0].first;
  const auto refuse = [&](StepRefusal why) { ++result.refused[static_cast<std::size_t>(why)]; };
  const std::unordered_set<NodeId> reached(expanded.begin(), expanded.end());
  for (const auto& candidate : near) {
    const NodeId node = candidate.second;
    const Place from = place(node);
    const std::size_t before = result.refused[0] + result.refused[1] + result.refused[2];
    for (int turn = -turns_; turn <= turns_; ++turn) {
      const int heading = (from.heading + turn + field_.headings()) % field_.headings();
      field_.for_each_place(heading, window(node, 2), [&](PlaceId id) {
        const NodeId to = node_of(id, 1 - side_of(node));
        if ((body_at(to) - goal_body_).norm() >= near[0].first || reached.contains(to)) return;
        const double climbed = place(to).at.z() - from.at.z();
        if (!in_reach(offset(node, place(to)))) return refuse(StepRefusal::reach);
        if (climbed > robot_.max_up_m || climbed < -robot_.max_down_m) return refuse(StepRefusal::height);
        if (!way_free(node, to)) refuse(StepRefusal::clearance);
      });
    }
    if (before == result.refused[0] + result.refused[1] + result.refused[2]) refuse(StepRefusal::support);
  }
  return result;
}

}  // namespace octosurf::footsteps
