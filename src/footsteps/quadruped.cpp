#include "footsteps/step_graph.hpp"
#include "geometry/even_odd.hpp"
#include "planning/rings.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <map>

namespace octosurf::footsteps {
namespace {

constexpr double quadruped_stance_height = 0.25;               // m off the given height for placing feet
constexpr std::array<std::size_t, 4> crawl_order{2, 0, 3, 1};  // hind before front, one side at a time

/// Of the body, in one cycle of steps.
std::vector<Eigen::Vector2d> cycles(const Quadruped& robot) {
  const double f = robot.max_step_m, s = robot.max_sideward_m;
  return {{f, 0}, {f / 2, 0}, {f / 2, s}, {f / 2, -s}, {0, s}, {0, -s}, {-f / 2, 0}, {0, 0}};
}

/// Front left, front right, hind left, hind right.
using FourFeet = std::array<PlaceId, 4>;

/// A quadruped's stances. A node is a body pose on a grid of 5 cm and 16 headings, with the foothold below
/// each hip; an edge moves the body slightly, each foot stepping at most once, one after the other. So the
/// feasibility of an edge depends on its two nodes only.
class QuadrupedGraph : public StepGraph {
 public:
  QuadrupedGraph(const Quadruped& robot, const Gait& gait, FootholdField& field, GuideMap& guide)
      : StepGraph(gait, field, guide), robot_(robot) {}

  Stance stance(const Standing& at) override;
  Moves moves(NodeId from, NodeId to, StepRefusal& why) override;
  NodePose pose(NodeId node) const override { return poses_[node]; }

 private:
  struct Node {
    int x, y, heading;
    FourFeet feet{};
    auto operator<=>(const Node&) const = default;
  };
  /// Plane through four feet: height under `at`, and its slope.
  struct Slope {
    double height;
    Eigen::Vector2d rise;
  };
  Node node_about(const Eigen::Vector2d& at, int heading) const {
    return {static_cast<int>(std::floor(at.x() / FootholdField::cell)),
            static_cast<int>(std::floor(at.y() / FootholdField::cell)), heading};
  }
  SwingPose body_of(const Node& node) const {
    return {{(node.x + 0.5) * FootholdField::cell, (node.y + 0.5) * FootholdField::cell},
            field_.yaw(node.heading)};
  }
  NodeId id_of(const Node& node);
  Eigen::Vector2d hip(const SwingPose& body, std::size_t leg) const {
    return body.at + Eigen::Rotation2Dd(body.yaw_rad) * gait_.feet[leg].at;
  }
  std::optional<PlaceId> foothold_below(const Eigen::Vector2d& hip, double low, double high, bool& any);
  std::vector<Option> options(NodeId node, bool all) override;
  Option moved(NodeId from, const Eigen::Vector2d& by, int turn);
  Slope slope_under(const FourFeet& feet, const Eigen::Vector2d& at) const;
  bool body_free(const SwingPose& from, const SwingPose& to, const FourFeet& feet);
  /// The place nearest to `wanted` where the body is over three feet with the margin.
  std::optional<Eigen::Vector2d> over_triangle(const FourFeet& feet, std::size_t lifted,
                                               const Eigen::Vector2d& wanted) const;

  const Quadruped robot_;
  std::vector<Node> nodes_;
  std::vector<NodePose> poses_;
  std::map<Node, NodeId> index_;
};

NodeId QuadrupedGraph::id_of(const Node& node) {
  const auto [found, made] = index_.try_emplace(node, static_cast<NodeId>(nodes_.size()));
  if (made) {
    const SwingPose body = body_of(node);
    nodes_.push_back(node);
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const PlaceId foot : node.feet) middle += place(foot).at.head<2>() / 4;
    poses_.push_back({body, middle, slope_under(node.feet, body.at).height, node.heading, 0, node.feet[0]});
  }
  return found->second;
}

// Near and good; `any`: something is near, but outside the heights.
std::optional<PlaceId> QuadrupedGraph::foothold_below(const Eigen::Vector2d& hip, double low, double high,
                                                      bool& any) {
  std::optional<PlaceId> best;
  double least = HUGE_VAL;
  field_.for_each_place(0, planning::box_about(hip, robot_.snap_m), [&](PlaceId id) {
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

StepGraph::Stance QuadrupedGraph::stance(const Standing& at) {
  Node wanted = node_about(at.at.head<2>(), field_.nearest_heading(at.yaw_rad));
  const SwingPose body = body_of(wanted);
  for (std::size_t leg = 0; leg < 4; ++leg) {
    bool any = false;
    const auto found = foothold_below(hip(body, leg), at.at.z() - quadruped_stance_height,
                                      at.at.z() + quadruped_stance_height, any);
    if (!found || stand_refused(*found)) return {};
    wanted.feet[leg] = *found;
  }
  if (!body_free(body, body, wanted.feet)) return {};
  return {{wanted.feet.begin(), wanted.feet.end()}, {id_of(wanted)}};
}

StepGraph::Option QuadrupedGraph::moved(NodeId from, const Eigen::Vector2d& by, int turn) {
  const Node start = nodes_[from];
  const SwingPose body = body_of(start);
  Node wanted = node_about(body.at + Eigen::Rotation2Dd(body.yaw_rad) * by, turned(start.heading, turn));
  Option option;
  for (std::size_t leg = 0; leg < 4; ++leg) {
    const Place foot = place(start.feet[leg]);
    bool any = false;
    const auto found = foothold_below(hip(body_of(wanted), leg), foot.at.z() - robot_.max_down_m,
                                      foot.at.z() + robot_.max_up_m, any);
    if (!found) {
      option.refusal = any ? StepRefusal::height : StepRefusal::support;
      return option;
    }
    wanted.feet[leg] = *found;
    if (*found != start.feet[leg]) option.cost += step_cost(foot, place(*found));
  }
  option.to = id_of(wanted);
  return option;
}

std::vector<StepGraph::Option> QuadrupedGraph::options(NodeId node, bool all) {
  std::vector<Option> found;
  for (const Eigen::Vector2d& by : cycles(robot_))
    for (int turn = -turns_; turn <= turns_; ++turn) {
      const Option option = moved(node, by, turn);
      if (all || !option.refusal) found.push_back(option);
    }
  return found;
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
  return body_sweep_free(columns_, robot_.body, from, slope.height, to,
                         slope.height + slope.rise.dot(to.at - from.at), slope.rise);
}

std::optional<Eigen::Vector2d> QuadrupedGraph::over_triangle(const FourFeet& feet, std::size_t lifted,
                                                             const Eigen::Vector2d& wanted) const {
  Ring2 corners;
  for (const std::size_t leg : {0, 2, 3, 1})  // counter-clockwise
    if (leg != lifted) corners.push_back(place(feet[leg]).at.head<2>());
  // Its sides moved inward, a triangle stays the same shape about the centre of its incircle.
  double around = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const double opposite = (corners[(i + 1) % 3] - corners[(i + 2) % 3]).norm();
    around += opposite;
    centre += opposite * corners[i];
  }
  centre /= around;
  const double radius = planning::cross(corners[1] - corners[0], corners[2] - corners[0]) / around;
  if (!(radius > robot_.support_margin_m + 1e-9)) return std::nullopt;
  for (Eigen::Vector2d& corner : corners)
    corner = centre + (1 - (robot_.support_margin_m + 1e-9) / radius) * (corner - centre);
  if (geometry::inside(corners, wanted)) return wanted;
  Eigen::Vector2d best = centre;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d on = planning::closest_on_segment(corners[i], corners[(i + 1) % 3], wanted);
    if ((on - wanted).norm() < (best - wanted).norm()) best = on;
  }
  return best;
}

StepGraph::Moves QuadrupedGraph::moves(NodeId from, NodeId to, StepRefusal& why) {
  const SwingPose start = poses_[from].body, end = poses_[to].body;
  const double turn = turn_between(start.yaw_rad, end.yaw_rad);
  FourFeet feet = nodes_[from].feet;
  SwingPose body = start;
  std::vector<FootMove> steps;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t leg = crawl_order[i];
    const PlaceId next = nodes_[to].feet[leg];
    if (next == feet[leg]) continue;
    if (const auto refusal = stand_refused(next)) {
      why = *refusal;
      return std::nullopt;
    }
    why = StepRefusal::reach;
    const double share = (static_cast<double>(i) + 1) / 5;
    const Eigen::Vector2d straight = start.at + share * (end.at - start.at);
    const auto over = over_triangle(feet, leg, straight);
    if (!over || (*over - straight).norm() > robot_.max_sway_m) return std::nullopt;
    const SwingPose there{*over, start.yaw_rad + share * turn};
    const Place &a = place(feet[leg]), &b = place(next);
    for (std::size_t k = 0; k < 4; ++k)
      if ((place(feet[k]).at.head<2>() - hip(there, k)).norm() > robot_.reach_m) return std::nullopt;
    if ((b.at.head<2>() - hip(there, leg)).norm() > robot_.reach_m) return std::nullopt;
    why = StepRefusal::clearance;
    if (!body_free(body, there, feet)) return std::nullopt;
    if (const auto refusal =
            swing_refused({a.at.head<2>(), 0}, {b.at.head<2>(), 0}, std::max(a.at.z(), b.at.z()))) {
      why = *refusal;
      return std::nullopt;
    }
    steps.push_back({leg, next, there, slope_under(feet, there.at).height});
    body = there;
    feet[leg] = next;
  }
  why = StepRefusal::clearance;
  if (!body_free(body, end, feet)) return std::nullopt;
  return steps;
}

}  // namespace

Gait gait_of(const Quadruped& robot) {
  const double ahead = robot.stance_length_m / 2, left = robot.stance_width_m / 2;
  // A foot moves as far as the body, plus the width of its search area, and the body's grid.
  const double turned = 2 * std::sin(robot.max_turn_rad / 2) * std::hypot(ahead, left);
  Gait gait(robot, {{FootName::front_left, {ahead, left}},
                    {FootName::front_right, {ahead, -left}},
                    {FootName::hind_left, {-ahead, left}},
                    {FootName::hind_right, {-ahead, -left}}});
  gait.round_feet = true;
  // What climbs cost is not in the guide's estimate: one plan in 40 would not be found within the budget.
  gait.costs.height = 0;
  gait.disc_radius_m = robot.foot.radius;
  gait.reach_m = std::hypot(robot.max_step_m, robot.max_sideward_m) + turned + 2 * robot.snap_m +
                 2 * FootholdField::cell;
  gait.longest_m = robot.max_step_m;
  gait.off_hip_m = robot.snap_m;
  for (int turn = -gait.turns(); turn <= gait.turns(); ++turn) {
    const double rad = turn * FootholdField::step_yaw();
    const double cost = gait.turn_cost(rad);
    gait.usual.push_back({turn, 4 + cost, cycles(robot)});
    if (turn != 0) gait.best.push_back({turn, cost});
    // At best one foot steps at a time, from behind its hip to before it: the middle moves by a quarter.
    WalkTable::Motion best{turn, 1 + cost, {}, (2 * robot.snap_m + FootholdField::cell / std::sqrt(2.0)) / 4};
    for (const Eigen::Vector2d& by : cycles(robot))
      for (const Gait::Foot& foot : gait.feet)
        best.by.push_back((by + Eigen::Rotation2Dd(rad) * foot.at - foot.at) / 4);
    gait.best.push_back(best);
  }
  return gait;
}

std::unique_ptr<StepGraph> graph_of(const Quadruped& robot, const Gait& gait, FootholdField& field,
                                    GuideMap& guide) {
  return std::make_unique<QuadrupedGraph>(robot, gait, field, guide);
}

}  // namespace octosurf::footsteps
