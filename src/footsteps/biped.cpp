#include "footsteps/step_graph.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_set>

namespace octosurf::footsteps {
namespace {

constexpr double biped_stance_height = 0.20;  // m off the given height, which may be approximate
constexpr double between_soles = 0.02;        // m, level

Eigen::Vector2d left_of(const Eigen::Vector2d& forward) { return {-forward.y(), forward.x()}; }

// The largest disc about the reference point inside a sole.
double disc_in(const ContactShape& shape) {
  if (shape.outline.empty()) return shape.radius;
  double radius = HUGE_VAL;
  planning::for_each_edge({{shape.outline, {}}}, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    radius = std::min(radius, planning::cross(a, b) / (b - a).norm());
  });
  return std::max(0.0, radius);
}

/// A biped's steps. A node is the stance foot: its place and side; the other foot is about to be placed
/// beside it.
///
/// A swing foot passes the stance foot at stance_width_m from it. Its motion before that belongs to the step
/// that placed the stance foot, its motion after to the next, and both can be checked independently: a node
/// needs no second foot.
class BipedGraph : public StepGraph {
 public:
  BipedGraph(const Biped& robot, const Gait& gait, FootholdField& field, GuideMap& guide)
      : StepGraph(gait, field, guide), robot_(robot) {}

  Stance stance(const Standing& at) override;
  Moves moves(NodeId from, NodeId to, StepRefusal& why) override;
  NodePose pose(NodeId node) const override {
    const Place& at = foot(node);
    const SwingPose body = beside(node, robot_.stance_width_m / 2);
    return {body, body.at, at.at.z(), at.heading, side_of(node), node / 2};
  }
  bool goal_is_cut_off(const std::vector<NodeId>& starts, std::size_t most) override;

 private:
  static NodeId node_of(PlaceId place, std::size_t side) { return 2 * place + static_cast<NodeId>(side); }
  static std::size_t side_of(NodeId node) { return node % 2; }  // 0 left, 1 right
  const Place& foot(NodeId node) const { return place(node / 2); }
  SwingPose sole(NodeId node) const { return {foot(node).at.head<2>(), field_.yaw(foot(node).heading)}; }
  /// So far from the foot on the side of the other.
  SwingPose beside(NodeId node, double m) const {
    const Place& at = foot(node);
    const double inward = side_of(node) == 0 ? -m : m;
    return {at.at.head<2>() + inward * left_of(forward_[at.heading]), field_.yaw(at.heading)};
  }
  std::vector<Option> options(NodeId node, bool all) override;
  std::optional<StepRefusal> refused(NodeId from, NodeId to) const;
  /// Nodes with a step to this one, by its limits only.
  std::vector<NodeId> predecessors(NodeId node);
  std::optional<StepRefusal> way_refused(NodeId from, NodeId to);
  bool soles_apart(NodeId a, NodeId b) const;

  const Biped robot_;
};

// Sideways and forward at once: the foot is placed within a box about the stance foot.
std::optional<StepRefusal> BipedGraph::refused(NodeId from, NodeId to) const {
  const Place &a = foot(from), &b = foot(to);
  const Eigen::Vector2d& ahead = forward_[a.heading];
  const Eigen::Vector2d d = b.at.head<2>() - a.at.head<2>();
  const double forward = ahead.dot(d), left = left_of(ahead).dot(d),
               outward = side_of(from) == 0 ? -left : left;
  if (forward > robot_.max_forward_m || forward < -robot_.max_backward_m || outward < robot_.min_width_m ||
      outward > robot_.max_width_m)
    return StepRefusal::reach;
  if (!climbable(a, b)) return StepRefusal::height;
  return std::nullopt;
}

std::vector<StepGraph::Option> BipedGraph::options(NodeId node, bool all) {
  const int ahead = foot(node).heading;
  const double outward = side_of(node) == 0 ? -1 : 1, times = all ? 2 : 1;
  Eigen::AlignedBox2d box;
  for (const double f : {-times * robot_.max_backward_m, times * robot_.max_forward_m})
    for (const double w :
         {all ? -times * robot_.max_width_m : robot_.min_width_m, times * robot_.max_width_m})
      box.extend(foot(node).at.head<2>() + f * forward_[ahead] + outward * w * left_of(forward_[ahead]));
  std::vector<Option> found;
  for (int turn = -turns_; turn <= turns_; ++turn)
    field_.for_each_place(turned(ahead, turn), box, [&](PlaceId id) {
      const NodeId to = node_of(id, 1 - side_of(node));
      const std::optional<StepRefusal> why = refused(node, to);
      if (all || !why) found.push_back({to, step_cost(foot(node), place(id)), why});
    });
  return found;
}

std::vector<NodeId> BipedGraph::predecessors(NodeId node) {
  const Place to = foot(node);
  std::vector<NodeId> result;
  for (int turn = -turns_; turn <= turns_; ++turn)
    field_.for_each_place(turned(to.heading, turn), planning::box_about(to.at.head<2>(), gait_.reach_m),
                          [&](PlaceId id) {
                            const NodeId from = node_of(id, 1 - side_of(node));
                            if (!refused(from, node)) result.push_back(from);
                          });
  return result;
}

bool BipedGraph::goal_is_cut_off(const std::vector<NodeId>& starts, std::size_t most) {
  std::unordered_set<NodeId> reached;
  std::vector<std::pair<NodeId, NodeId>> open;  // a node, and one it leads to; the last is processed first
  // The last step ends with both feet at the goal.
  std::vector<NodeId> ends;
  for_each_goal_place([&](std::size_t side, PlaceId id) { ends.push_back(node_of(id, side)); });
  for (const NodeId end : ends)
    for (const NodeId from : predecessors(end))
      if (in_goal(from)) open.emplace_back(from, end);
  while (!open.empty() && reached.size() < most) {
    const auto [node, to] = open.back();
    open.pop_back();
    if (reached.contains(node) || way_refused(node, to)) continue;
    if (std::find(starts.begin(), starts.end(), node) != starts.end()) return false;
    reached.insert(node);
    for (const NodeId from : predecessors(node))
      if (!reached.contains(from)) open.emplace_back(from, node);
  }
  return open.empty();
}

StepGraph::Moves BipedGraph::moves(NodeId from, NodeId to, StepRefusal& why) {
  if (const auto refusal = way_refused(from, to)) {
    why = *refusal;
    return std::nullopt;
  }
  const NodePose at = pose(to);
  return {{{at.foot, at.place, at.body, at.ground}}};
}

std::optional<StepRefusal> BipedGraph::way_refused(NodeId from, NodeId to) {
  const double a = foot(from).at.z(), b = foot(to).at.z(), high = std::max(a, b);
  if (!soles_apart(from, to) || !body_sweep_free(columns_, robot_.body, pose(from).body, a, pose(to).body, b))
    return StepRefusal::clearance;
  if (const auto why = stand_refused(to / 2)) return why;
  if (const auto why = swing_refused(beside(from, robot_.stance_width_m), sole(to), high)) return why;
  return swing_refused(sole(from), beside(to, robot_.stance_width_m), high);
}

// Whether the soles, projected level, are on opposite sides of a strip `between_soles` wide.
bool BipedGraph::soles_apart(NodeId a, NodeId b) const {
  const Eigen::Vector2d d = foot(b).at.head<2>() - foot(a).at.head<2>();
  if (d.norm() >= 2 * robot_.foot.reach() + between_soles) return true;
  const auto outline = [&](NodeId node) {
    Ring2 ring = robot_.foot.outline;
    for (Eigen::Vector2d& p : ring) p = Eigen::Rotation2Dd(sole(node).yaw_rad) * p;
    return ring;
  };
  // They meet where b lies within the sum of a's sole and b's mirrored one, whose sides are those of both.
  return planning::depth_in(planning::minkowski_sum(outline(a), planning::mirrored(outline(b))), d) <=
         -between_soles;
}

StepGraph::Stance BipedGraph::stance(const Standing& at) {
  struct Candidate {
    double squared;
    PlaceId id;
  };
  const int heading = field_.nearest_heading(at.yaw_rad);
  std::array<std::vector<Candidate>, 2> candidates;
  for (std::size_t side = 0; side < 2; ++side) {
    const Eigen::Vector2d nominal =
        at.at.head<2>() + Eigen::Rotation2Dd(field_.yaw(heading)) * gait_.feet[side].at;
    field_.for_each_place(heading, planning::box_about(nominal, goal_radius), [&](PlaceId id) {
      const Eigen::Vector3d& p = place(id).at;
      const double squared = (p.head<2>() - nominal).squaredNorm(), off = p.z() - at.at.z();
      if (squared <= goal_radius * goal_radius && std::abs(off) <= biped_stance_height)
        candidates[side].push_back({squared + off * off, id});
    });
    std::stable_sort(candidates[side].begin(), candidates[side].end(),
                     [](const Candidate& a, const Candidate& b) { return a.squared < b.squared; });
  }
  Stance best;
  double least = HUGE_VAL;
  for (const Candidate& left : candidates[0]) {
    if (stand_refused(left.id)) continue;  // before all pairs with it are tried
    for (const Candidate& right : candidates[1]) {
      if (left.squared + right.squared >= least) break;
      const NodeId a = node_of(left.id, 0), b = node_of(right.id, 1);
      if (stand_refused(right.id) || refused(a, b) || !climbable(place(right.id), place(left.id)) ||
          way_refused(a, b) || way_refused(b, a))
        continue;
      least = left.squared + right.squared;
      best = {{left.id, right.id}, {a, b}};
    }
  }
  return best;
}

}  // namespace

Gait gait_of(const Biped& robot) {
  const double half = robot.stance_width_m / 2;
  const double longest = std::max(robot.max_forward_m, robot.max_backward_m);
  // Half the side of the square that contains the body over a foot in any heading: the body's middle is half
  // a stance beside it.
  const double inscribed = std::min(robot.body.length_m, robot.body.width_m - robot.stance_width_m) / 2;
  Gait gait(robot, {{FootName::left, {0, half}}, {FootName::right, {0, -half}}});
  gait.disc_radius_m = disc_in(robot.foot);
  gait.reach_m = std::hypot(longest, robot.max_width_m);
  gait.trunk_reach_m = std::max(0.0, inscribed / std::sqrt(2.0) - GuideMap::slack_m);
  gait.longest_m = robot.max_forward_m;
  const double aside = (robot.max_width_m - robot.min_width_m) / 2;  // of two steps, on average
  for (int turn = -gait.turns(); turn <= gait.turns(); ++turn) {
    const double rad = turn * FootholdField::step_yaw();
    WalkTable::Motion best{turn, 1 + gait.turn_cost(rad)}, usual = best;
    for (const double ahead : {robot.max_forward_m, -robot.max_backward_m})
      for (const double width : {robot.min_width_m, robot.max_width_m})
        for (const int left : {-1, 1})  // the foot that steps
          best.by.emplace_back(ahead + left * half * std::sin(rad),
                               left * (width - half - half * std::cos(rad)));
    usual.by = {{robot.max_forward_m, 0}, {-robot.max_backward_m, 0}, {0, aside}, {0, -aside}};
    gait.best.push_back(best);
    gait.usual.push_back(usual);
  }
  return gait;
}

std::unique_ptr<StepGraph> graph_of(const Biped& robot, const Gait& gait, FootholdField& field,
                                    GuideMap& guide) {
  return std::make_unique<BipedGraph>(robot, gait, field, guide);
}

}  // namespace octosurf::footsteps
