#pragma once

#include "footsteps/anytime_search.hpp"
#include "footsteps/guide_map.hpp"
#include "footsteps/refusals.hpp"
#include "planning/rings.hpp"

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// A robot's stances and the moves between them: the part common to all robots. Walking frame.
///
/// Nodes depend on the robot: with body poses, as for a quadruped, a biped's plans had twice the steps (on
/// stairs 1,200 for 620), because every move ends with its feet beside each other.
class StepGraph {
 public:
  /// Feet on the ground, by Gait::feet, and the nodes from which it walks on. No nodes: it cannot stand.
  struct Stance {
    std::vector<PlaceId> feet{};
    std::vector<NodeId> nodes{};
  };
  /// One foot's step, and the body's pose at it.
  struct FootMove {
    std::size_t foot = 0;
    PlaceId to = 0;
    SwingPose body{};
    double ground = 0;  ///< z under the body's middle
  };
  using Moves = std::optional<std::vector<FootMove>>;
  struct NodePose {
    SwingPose body;
    Eigen::Vector2d middle;  ///< of the feet, if they stand as usual
    double ground;           ///< as FootMove's
    int heading;
    std::size_t foot;  ///< whose way is the guide's
    PlaceId place;     ///< of that foot
  };

  StepGraph(const Gait& gait, FootholdField& field, GuideMap& guide);
  StepGraph(const StepGraph&) = delete;
  StepGraph& operator=(const StepGraph&) = delete;
  virtual ~StepGraph() = default;

  /// The stance nearest to the nominal one.
  virtual Stance stance(const Standing& at) = 0;
  /// The steps of a move, if nothing is in their way; otherwise `why`.
  virtual Moves moves(NodeId from, NodeId to, StepRefusal& why) = 0;
  virtual NodePose pose(NodeId node) const = 0;
  /// True if at most `most` nodes lead to the goal, without any of `starts`: a backward search.
  virtual bool goal_is_cut_off(const std::vector<NodeId>& /*starts*/, std::size_t /*most*/) { return false; }

  /// Sets the goal: all stances within a hand's breadth of this one.
  void aim(const Stance& goal);
  bool at_goal(const Stance& stance) const;
  /// Whether to ignore the guide's result that there is no path.
  void ignore_guide(bool ignore) { guideless_ = ignore; }

  // Interface of AnytimeSearch.
  const std::vector<StepEdge>& steps(NodeId node);
  bool passable(NodeId from, std::size_t step);
  double bound(NodeId node) { return bound(pose(node)); }
  double guide(NodeId node);
  bool ends(NodeId from, NodeId to) const { return in_goal(to) && (goal_.size() == 1 || in_goal(from)); }
  std::size_t node_count() const { return steps_.size(); }

  /// The place nearest to the goal that a failed search reached, and the obstacles there.
  Frontier frontier(const std::vector<NodeId>& expanded);

 protected:
  /// A node to move to, or why not.
  struct Option {
    NodeId to = no_node;
    double cost = 0;  ///< of the steps
    std::optional<StepRefusal> refusal{};
  };
  /// Moves within the limits, unchecked for collisions; `all`: also those that are just beyond the limits.
  virtual std::vector<Option> options(NodeId node, bool all) = 0;

  const Place& place(PlaceId id) const { return field_.place(id); }
  double step_cost(const Place& from, const Place& to) const;
  bool climbable(const Place& from, const Place& to) const;
  int turned(int heading, int turn) const { return (heading + turn + field_.headings()) % field_.headings(); }
  bool in_goal(NodeId node) const;
  /// What a leg meets that swings from one place to the other over `ground`: nothing at one of two heights.
  std::optional<StepRefusal> swing_refused(const SwingPose& from, const SwingPose& to, double ground) const;
  /// Why a foot cannot stand there; the slowest check, some 60 µs.
  std::optional<StepRefusal> stand_refused(PlaceId id) const;
  /// Calls visit(foot, id) for the places within a hand's breadth of the goal's feet.
  template <class Visit>
  void for_each_goal_place(const Visit& visit) {
    for (std::size_t foot = 0; foot < goal_feet_.size(); ++foot) {
      const Eigen::Vector3d middle = place(goal_feet_[foot]).at;
      field_.for_each_place(goal_[0].heading, planning::box_about(middle.head<2>(), goal_radius),
                            [&](PlaceId id) {
                              if ((place(id).at - middle).norm() <= goal_radius) visit(foot, id);
                            });
    }
  }

  /// m around the given place in which feet are placed: a cell and its neighbours, to find a foothold beside
  /// a ridge, within the accuracy of a robot's odometry.
  static constexpr double goal_radius = 0.10;

  const Gait& gait_;
  FootholdField& field_;
  ObstacleColumns& columns_;
  const LegBox leg_;
  const int turns_;                       ///< heading steps of the widest turn
  std::vector<Eigen::Vector2d> forward_;  ///< by heading; used for every candidate place

 private:
  double bound(const NodePose& at);
  double to_goal(const NodePose& at) const { return (at.body.at - goal_body_).norm(); }
  GuideMap& guide_;
  WalkTable best_, usual_;
  std::vector<std::vector<StepEdge>> steps_;
  std::vector<bool> made_;
  std::vector<PlaceId> goal_feet_;
  std::vector<NodePose> goal_;  ///< by foot of a node
  Eigen::Vector2d goal_body_ = Eigen::Vector2d::Zero();
  double around_goal_ = 0;               ///< m, from goal_body_ to the farthest body in the goal
  double goal_low_ = 0, goal_high_ = 0;  ///< m, of the ground in the goal
  bool guideless_ = false;
};

std::unique_ptr<StepGraph> graph_of(const Biped& robot, const Gait& gait, FootholdField& field,
                                    GuideMap& guide);
std::unique_ptr<StepGraph> graph_of(const Quadruped& robot, const Gait& gait, FootholdField& field,
                                    GuideMap& guide);

}  // namespace octosurf::footsteps
