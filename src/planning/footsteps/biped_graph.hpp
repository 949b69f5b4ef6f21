#pragma once

#include "planning/footsteps/anytime_search.hpp"
#include "planning/footsteps/foothold_field.hpp"
#include "planning/footsteps/guide_map.hpp"
#include "planning/footsteps/obstacle_columns.hpp"
#include "planning/footsteps/swing.hpp"
#include "planning/footsteps/walking_ground.hpp"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// A biped's steps. A node is the stance foot: its place and side; the other foot is about to be placed
/// beside it.
///
/// A swing foot passes the stance foot at stance_width_m from it. Its motion before that belongs to the step
/// that placed the stance foot, its motion after to the next, and both can be checked independently: a node
/// needs no second foot.
class BipedGraph {
 public:
  BipedGraph(const Biped& robot, FootholdField& field, ObstacleColumns& columns, GuideMap& guide);

  NodeId node_of(PlaceId place, int side) const { return 2 * place + static_cast<NodeId>(side); }
  static PlaceId place_of(NodeId node) { return node / 2; }
  static int side_of(NodeId node) { return static_cast<int>(node % 2); }  ///< 0 left, 1 right

  /// The pair of places, left and right, nearest to the nominal stance there; empty: none.
  std::vector<PlaceId> stance(const Eigen::Vector3d& at, int heading);
  /// Sets the goal: all pairs of places within a hand's breadth of `feet`, a stance.
  void aim(const Eigen::Vector3d& at, const std::vector<PlaceId>& feet);
  /// Whether to ignore the guide's result that there is no path.
  void ignore_guide(bool ignore) { guideless_ = ignore; }
  bool at_goal(const std::vector<PlaceId>& feet) const;

  // Interface of AnytimeSearch.
  const std::vector<StepEdge>& steps(NodeId node);
  bool passable(NodeId from, std::size_t step);
  double bound(NodeId node) const;
  double guide(NodeId node) const;
  bool ends(NodeId from, NodeId to) const { return goal_.contains(from) && goal_.contains(to); }
  std::size_t node_count() const { return steps_.size(); }

  /// True if at most `most` nodes lead to the goal, without any of `starts`: a backward search.
  bool goal_is_cut_off(const std::vector<NodeId>& starts, std::size_t most);

  /// The place nearest to the goal that a failed search reached, and the obstacles there.
  Frontier frontier(const std::vector<NodeId>& expanded);

  const Place& place(NodeId node) const { return field_.place(place_of(node)); }
  /// The middle of its stance, with the other foot just placed beside this one.
  Eigen::Vector2d body_at(NodeId node) const;
  bool way_free(NodeId from, NodeId to);

 private:
  /// A place relative to the stance foot: forward, outward, and heading steps to the left.
  struct Offset {
    double forward, outward;
  };
  Offset offset(NodeId from, const Place& to) const;
  bool in_reach(const Offset& offset) const;
  double cost(NodeId from, NodeId to) const;
  void make_steps(NodeId node, std::vector<StepEdge>& made);
  /// Nodes with a step to this one, by its limits only.
  std::vector<NodeId> predecessors(NodeId node);
  bool step_allowed(NodeId from, NodeId to) const;
  Eigen::AlignedBox2d window(NodeId node, double times) const;
  SwingPose pose(const Place& place) const { return {place.at.head<2>(), field_.yaw(place.heading)}; }
  SwingPose beside(NodeId standing) const;  ///< where the swing foot passes
  bool soles_apart(const Place& a, const Place& b) const;
  bool body_free(NodeId from, NodeId to);
  const Biped robot_;
  FootholdField& field_;
  ObstacleColumns& columns_;
  GuideMap& guide_;
  LegBox leg_;
  std::vector<Eigen::Vector2d> forward_;  ///< by heading; used for every candidate place
  int turns_;                             ///< heading steps of the widest turn
  double body_step_;                      ///< m, the farthest that a step moves the body's middle
  std::vector<std::vector<StepEdge>> steps_;
  std::vector<bool> made_;
  std::unordered_set<NodeId> goal_;
  Eigen::Vector2d goal_body_ = Eigen::Vector2d::Zero();
  double goal_radius_ = 0;
  int goal_heading_ = 0;
  bool guideless_ = false;
};

}  // namespace octosurf::footsteps
