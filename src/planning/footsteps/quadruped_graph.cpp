#include "planning/footsteps/quadruped_graph.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace octosurf::footsteps {
namespace {

constexpr double cell = 0.05;  // m
constexpr int quadruped_headings = 16;
constexpr double heading_step = 2 * std::numbers::pi / quadruped_headings;
constexpr double quadruped_stance_height = 0.25;               // m off the given height for placing feet
constexpr double goal_radius = 0.10;                           // m
constexpr std::array<std::size_t, 4> crawl_order{2, 0, 3, 1};  // hind before front, one side at a time

int wrapped(int heading) { return (heading % quadruped_headings + quadruped_headings) % quadruped_headings; }

}  // namespace

QuadrupedGraph::QuadrupedGraph(const Quadruped& robot, WalkingGround& ground, GuideMap& guide)
    : robot_(robot),
      ground_(ground),
      guide_(guide),
      leg_(LegBox::of(robot.foot)),
      first_yaw_(edge_direction(ground.field.surfaces(), heading_step)) {}

SwingPose QuadrupedGraph::body_of(NodeId id) const {
  const Node& at = nodes_[id];
  return {{(at.x + 0.5) * cell, (at.y + 0.5) * cell}, first_yaw_ + at.heading * heading_step};
}

double QuadrupedGraph::ground_of(NodeId id) const {
  return slope_under(nodes_[id].feet, body_of(id).at).height;
}

Eigen::Vector2d QuadrupedGraph::hip(const SwingPose& body, std::size_t leg) const {
  const Eigen::Vector2d offset((leg < 2 ? 1 : -1) * robot_.stance_length_m / 2,
                               (leg % 2 == 0 ? 1 : -1) * robot_.stance_width_m / 2);
  return body.at + Eigen::Rotation2Dd(body.yaw_rad) * offset;
}

NodeId QuadrupedGraph::node(const Node& wanted) {
  const auto [found, made] = index_.try_emplace(wanted, static_cast<NodeId>(nodes_.size()));
  if (made) nodes_.push_back(wanted);
  return found->second;
}

// Near and good; `any`: something is near, but outside the heights.
std::optional<PlaceId> QuadrupedGraph::foothold_below(const Eigen::Vector2d& hip, double low, double high,
                                                      bool& any) {
  const Eigen::Vector2d r(robot_.snap_m, robot_.snap_m);
  std::optional<PlaceId> best;
  double least = HUGE_VAL;
  ground_.field.for_each_place(0, {hip - r, hip + r}, [&](PlaceId id) {
    const Place& p = place(id);
    const double distance = (p.at.head<2>() - hip).norm();
    if (distance > robot_.snap_m) return;
    any = true;
    const double dear = distance / robot_.snap_m + p.cost;
    if (p.at.z() < low || p.at.z() > high || dear >= least) return;
    least = dear;
    best = id;
  });
  return best;
}

std::optional<NodeId> QuadrupedGraph::stance(const Standing& at) {
  Node wanted{static_cast<int>(std::floor(at.at.x() / cell)),
              static_cast<int>(std::floor(at.at.y() / cell)),
              wrapped(static_cast<int>(std::round((at.yaw_rad - first_yaw_) / heading_step))),
              {}};
  const SwingPose body{{(wanted.x + 0.5) * cell, (wanted.y + 0.5) * cell},
                       first_yaw_ + wanted.heading * heading_step};
  for (std::size_t leg = 0; leg < 4; ++leg) {
    bool any = false;
    const auto found = foothold_below(hip(body, leg), at.at.z() - quadruped_stance_height,
                                      at.at.z() + quadruped_stance_height, any);
    if (!found || !ground_.field.stands(*found)) return std::nullopt;
    wanted.feet[leg] = *found;
  }
  if (!body_free(body, body, wanted.feet)) return std::nullopt;
  return node(wanted);
}

void QuadrupedGraph::aim(NodeId goal) {
  goal_ = body_of(goal);
  goal_heading_ = nodes_[goal].heading;
  std::vector<GuideMap::Target> targets;
  for (const PlaceId id : nodes_[goal].feet) targets.push_back({place(id).at, place(id).surface});
  guide_.aim(targets);
}

bool QuadrupedGraph::at_goal(NodeId id) const {
  return nodes_[id].heading == goal_heading_ && (body_of(id).at - goal_.at).norm() <= goal_radius;
}

std::optional<NodeId> QuadrupedGraph::moved(NodeId from, double forward, double left, int turn,
                                            StepRefusal& why) {
  const SwingPose body = body_of(from);
  const Eigen::Vector2d to = body.at + Eigen::Rotation2Dd(body.yaw_rad) * Eigen::Vector2d(forward, left);
  Node wanted{static_cast<int>(std::floor(to.x() / cell)),
              static_cast<int>(std::floor(to.y() / cell)),
              wrapped(nodes_[from].heading + turn),
              {}};
  const SwingPose there{{(wanted.x + 0.5) * cell, (wanted.y + 0.5) * cell},
                        first_yaw_ + wanted.heading * heading_step};
  for (std::size_t leg = 0; leg < 4; ++leg) {
    const double z = place(nodes_[from].feet[leg]).at.z();
    bool any = false;
    const auto found = foothold_below(hip(there, leg), z - robot_.max_down_m, z + robot_.max_up_m, any);
    if (!found) {
      why = any ? StepRefusal::height : StepRefusal::support;
      return std::nullopt;
    }
    wanted.feet[leg] = *found;
  }
  return node(wanted);
}

const std::vector<StepEdge>& QuadrupedGraph::steps(NodeId id) {
  if (id >= steps_.size()) {
    steps_.resize(std::max<std::size_t>(id + 1, nodes_.size()) * 2);
    made_.resize(steps_.size());
  }
  if (made_[id]) return steps_[id];
  std::vector<StepEdge> made;
  const double f = robot_.max_step_m, s = robot_.max_sideward_m;
  const int turns = robot_.max_turn_rad + 1e-9 >= heading_step ? 1 : 0;
  for (const auto& [forward, left] : {std::pair{f, 0.0},
                                      {f / 2, 0.0},
                                      {f / 2, s},
                                      {f / 2, -s},
                                      {0.0, s},
                                      {0.0, -s},
                                      {-f / 2, 0.0},
                                      {0.0, 0.0}}) {
    for (int turn = -turns; turn <= turns; ++turn) {
      StepRefusal why{};
      const auto to = moved(id, forward, left, turn, why);
      if (!to || *to == id) continue;
      double cost = robot_.costs.length * (body_of(*to).at - body_of(id).at).norm() / robot_.max_step_m +
                    robot_.costs.turn * std::abs(turn);
      for (std::size_t leg = 0; leg < 4; ++leg) {
        const PlaceId foot = nodes_[*to].feet[leg];
        if (foot != nodes_[id].feet[leg]) cost += 1 + place(foot).cost;
      }
      made.push_back({*to, static_cast<float>(cost), StepEdge::Collision::unchecked});
    }
  }
  steps_[id] = std::move(made);
  made_[id] = true;
  return steps_[id];
}

bool QuadrupedGraph::passable(NodeId from, std::size_t step) {
  StepEdge& edge = steps_[from][step];
  if (edge.collision == StepEdge::Collision::unchecked)
    edge.collision = crawl(from, edge.to) ? StepEdge::Collision::free : StepEdge::Collision::blocked;
  return edge.collision == StepEdge::Collision::free;
}

QuadrupedGraph::Slope QuadrupedGraph::slope_under(const FourFeet& feet, const Eigen::Vector2d& at) const {
  Eigen::Matrix<double, 4, 3> A;
  Eigen::Vector4d z;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d& p = place(feet[static_cast<std::size_t>(i)]).at;
    A.row(i) << p.x() - at.x(), p.y() - at.y(), 1;
    z[i] = p.z();
  }
  const Eigen::Vector3d plane = A.colPivHouseholderQr().solve(z);
  return {plane.z(), plane.head<2>()};
}

bool QuadrupedGraph::body_free(const SwingPose& from, const SwingPose& to, const FourFeet& feet) {
  const Slope slope = slope_under(feet, from.at);
  return body_sweep_free(ground_.columns, robot_.body, from, slope.height, to,
                         slope.height + slope.rise.dot(to.at - from.at), slope.rise);
}

std::optional<Eigen::Vector2d> QuadrupedGraph::over_triangle(const FourFeet& feet, std::size_t lifted,
                                                             const Eigen::Vector2d& wanted) const {
  std::vector<Eigen::Vector2d> corners;
  for (const std::size_t leg : {0, 2, 3, 1})  // counter-clockwise
    if (leg != lifted) corners.push_back(place(feet[leg]).at.head<2>());
  // The three sides moved inward by the margin, n·p ≥ c, and their intersections.
  std::array<Eigen::Vector2d, 3> n;
  std::array<double, 3> c{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d side = (corners[(i + 1) % 3] - corners[i]).normalized();
    n[i] = {-side.y(), side.x()};
    c[i] = n[i].dot(corners[i]) + robot_.support_margin_m + 1e-9;
  }
  std::array<Eigen::Vector2d, 3> inner;
  for (std::size_t i = 0; i < 3; ++i) {
    Eigen::Matrix2d M;
    M << n[i].transpose(), n[(i + 2) % 3].transpose();
    if (std::abs(M.determinant()) < 1e-6) return std::nullopt;
    inner[i] = M.inverse() * Eigen::Vector2d(c[i], c[(i + 2) % 3]);
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (n[i].dot(inner[(i + 2) % 3]) < c[i]) return std::nullopt;  // the triangle is empty
  Eigen::Vector2d best = wanted;
  double least = HUGE_VAL;
  bool inside = true;
  for (std::size_t i = 0; i < 3; ++i) {
    inside = inside && n[i].dot(wanted) >= c[i];
    const Eigen::Vector2d side = inner[(i + 1) % 3] - inner[i];
    const double share =
        side.squaredNorm() > 0 ? std::clamp(side.dot(wanted - inner[i]) / side.squaredNorm(), 0.0, 1.0) : 0;
    const Eigen::Vector2d on = inner[i] + share * side;
    if ((on - wanted).norm() < least) least = (on - wanted).norm(), best = on;
  }
  return inside ? wanted : best;
}

std::optional<std::vector<CrawlStep>> QuadrupedGraph::crawl(NodeId from, NodeId to) {
  StepRefusal why{};
  return crawl(from, to, why);
}

std::optional<std::vector<CrawlStep>> QuadrupedGraph::crawl(NodeId from, NodeId to, StepRefusal& why) {
  const SwingPose start = body_of(from), end = body_of(to);
  const double turn = turn_between(start.yaw_rad, end.yaw_rad);
  FourFeet feet = nodes_[from].feet;
  SwingPose body = start;
  std::vector<CrawlStep> steps;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t leg = crawl_order[i];
    const PlaceId next = nodes_[to].feet[leg];
    if (next == feet[leg]) continue;
    why = StepRefusal::clearance;
    if (!ground_.field.stands(next)) return std::nullopt;
    why = StepRefusal::reach;
    const double share = (static_cast<double>(i) + 1) / 5;
    const Eigen::Vector2d straight = start.at + share * (end.at - start.at);
    const auto over = over_triangle(feet, leg, straight);
    if (!over || (*over - straight).norm() > robot_.max_sway_m) return std::nullopt;
    const SwingPose there{*over, start.yaw_rad + share * turn};
    for (std::size_t k = 0; k < 4; ++k)
      if ((place(feet[k]).at.head<2>() - hip(there, k)).norm() > robot_.reach_m) return std::nullopt;
    if ((place(next).at.head<2>() - hip(there, leg)).norm() > robot_.reach_m) return std::nullopt;
    why = StepRefusal::clearance;
    const Place &a = place(feet[leg]), &b = place(next);
    const double high = std::max(a.at.z(), b.at.z());
    if (!swing_free(ground_.columns, leg_, {a.at.head<2>(), 0}, {b.at.head<2>(), 0}, high,
                    {robot_.lift_m, robot_.high_lift_m, robot_.body.from_m}) ||
        !body_free(body, there, feet))
      return std::nullopt;
    steps.push_back({leg, next, there, slope_under(feet, there.at).height});
    body = there;
    feet[leg] = next;
  }
  if (!body_free(body, end, feet)) return std::nullopt;
  return steps;
}

double QuadrupedGraph::bound(NodeId id) const {
  if (!guideless_ && guide_.steps(place(nodes_[id].feet[0])) == std::numeric_limits<double>::infinity())
    return std::numeric_limits<double>::infinity();
  const double way = std::max(0.0, (body_of(id).at - goal_.at).norm() - goal_radius);
  return robot_.costs.length * way / robot_.max_step_m;
}

double QuadrupedGraph::guide(NodeId id) const {
  const double straight = (body_of(id).at - goal_.at).norm();
  const double way = guideless_
                         ? straight
                         : std::max(straight, guide_.metres(place(nodes_[id].feet[0])) - 2 * robot_.snap_m);
  int turn = std::abs(nodes_[id].heading - goal_heading_);
  turn = std::min(turn, quadruped_headings - turn);
  // Four steps for each max_step_m, and for each turn.
  return std::max(bound(id), (4 + robot_.costs.length) * way / robot_.max_step_m + 4 * turn);
}

Frontier QuadrupedGraph::frontier(const std::vector<NodeId>& expanded) {
  Frontier result;
  if (expanded.empty()) return result;
  const NodeId nearest = *std::min_element(expanded.begin(), expanded.end(), [&](NodeId a, NodeId b) {
    return (body_of(a).at - goal_.at).norm() < (body_of(b).at - goal_.at).norm();
  });
  result.nearest << body_of(nearest).at, ground_of(nearest);
  result.nearest_m = (body_of(nearest).at - goal_.at).norm();
  const double f = robot_.max_step_m, s = robot_.max_sideward_m;
  for (const NodeId id : expanded) {
    if ((body_of(id).at - goal_.at).norm() > result.nearest_m + 2 * cell) continue;
    for (const auto& [forward, left] :
         {std::pair{f, 0.0}, {f / 2, s}, {f / 2, -s}, {0.0, s}, {0.0, -s}, {-f / 2, 0.0}}) {
      StepRefusal why = StepRefusal::reach;
      const auto to = moved(id, forward, left, 0, why);
      if (to && crawl(id, *to, why)) continue;
      ++result.refused[static_cast<std::size_t>(why)];
    }
  }
  return result;
}

}  // namespace octosurf::footsteps
