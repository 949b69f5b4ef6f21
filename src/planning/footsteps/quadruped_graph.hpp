#pragma once

#include "planning/footsteps/anytime_search.hpp"
#include "planning/footsteps/guide_map.hpp"
#include "planning/footsteps/swing.hpp"
#include "planning/footsteps/walking_ground.hpp"

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// Front left, front right, hind left, hind right.
using FourFeet = std::array<PlaceId, 4>;

/// One leg's step in a crawl: meanwhile the body stands over the three others.
struct CrawlStep {
  std::size_t leg = 0;
  PlaceId to = 0;
  SwingPose body;
  double ground = 0;  ///< z under the body's middle
};

/// A quadruped's stances. A node is a body pose on a grid of 5 cm and 16 headings, with the foothold below
/// each hip; an edge moves the body slightly, each foot stepping at most once, one after the other. So the
/// feasibility of an edge depends on its two nodes only.
class QuadrupedGraph {
 public:
  QuadrupedGraph(const Quadruped& robot, WalkingGround& ground, GuideMap& guide);

  /// The stance at a place, near ground of this height; empty if a foot finds none.
  std::optional<NodeId> stance(const Standing& at);
  void aim(NodeId goal);
  bool at_goal(NodeId node) const;
  std::optional<std::vector<CrawlStep>> crawl(NodeId from, NodeId to);

  // Interface of AnytimeSearch.
  const std::vector<StepEdge>& steps(NodeId node);
  bool passable(NodeId from, std::size_t step);
  double bound(NodeId node) const;
  double guide(NodeId node) const;
  bool ends(NodeId, NodeId to) const { return at_goal(to); }
  std::size_t node_count() const { return nodes_.size(); }

  Frontier frontier(const std::vector<NodeId>& expanded);
  void ignore_guide(bool ignore) { guideless_ = ignore; }

  SwingPose body_of(NodeId node) const;
  double ground_of(NodeId node) const;
  const FourFeet& feet_of(NodeId node) const { return nodes_[node].feet; }
  const Place& place(PlaceId id) const { return ground_.field.place(id); }
  Eigen::Vector2d hip(const SwingPose& body, std::size_t leg) const;

 private:
  struct Node {
    int x, y, heading;
    FourFeet feet;
    auto operator<=>(const Node&) const = default;
  };
  /// Plane through four feet: height under `at`, and its slope.
  struct Slope {
    double height;
    Eigen::Vector2d rise;
  };
  NodeId node(const Node& wanted);
  std::optional<PlaceId> foothold_below(const Eigen::Vector2d& hip, double low, double high, bool& any);
  std::optional<NodeId> moved(NodeId from, double forward, double left, int turn, StepRefusal& why);
  std::optional<std::vector<CrawlStep>> crawl(NodeId from, NodeId to, StepRefusal& why);
  Slope slope_under(const FourFeet& feet, const Eigen::Vector2d& at) const;
  bool body_free(const SwingPose& from, const SwingPose& to, const FourFeet& feet);
  /// The place nearest to `wanted` where the body is over three feet with the margin.
  std::optional<Eigen::Vector2d> over_triangle(const FourFeet& feet, std::size_t lifted,
                                               const Eigen::Vector2d& wanted) const;

  const Quadruped robot_;
  WalkingGround& ground_;
  GuideMap& guide_;
  LegBox leg_;
  double first_yaw_;
  std::vector<Node> nodes_;
  std::map<Node, NodeId> index_;
  std::vector<std::vector<StepEdge>> steps_;
  std::vector<bool> made_;
  SwingPose goal_;
  int goal_heading_ = 0;
  bool guideless_ = false;
};

}  // namespace octosurf::footsteps
