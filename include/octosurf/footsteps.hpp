#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// Which foot a step is of. A biped has the first two, a quadruped the other four.
enum class FootName { left, right, front_left, front_right, hind_left, hind_right };
/// By FootName.
inline constexpr std::array<std::string_view, 6> foot_names{"left",        "right",     "front_left",
                                                            "front_right", "hind_left", "hind_right"};
/// As in files: "left", "right", "front_left", …
constexpr std::string_view foot_name(FootName foot) { return foot_names[static_cast<std::size_t>(foot)]; }

/// The box about a robot's trunk that nothing may stand in, about the middle between its feet. A biped's is
/// upright; a quadruped's leans as the plane through its four feet does, as it would hit the steps before it
/// otherwise: heights are then over that plane.
struct BodyBox {
  double length_m = 0;  ///< along its heading
  double width_m = 0;   ///< across
  double from_m = 0;    ///< above the ground under it; what is lower is the legs' affair
  double to_m = 0;      ///< above the ground under it
};

/// What is dear in a step besides that it is one, which costs 1. A step on a place that is as bad as the
/// limits allow in everything counts as three good ones: worth a detour of two steps.
struct StepCosts {
  double length = 0.5;          ///< of the longest step; in proportion for shorter ones
  double height = 0.5;          ///< of the highest
  double turn = 0.3;            ///< of the widest turn
  double margin = 1.0;          ///< on an edge; nothing from good_margin_m on
  double slope = 0.5;           ///< on the steepest slope
  double uncertainty = 0.5;     ///< on a plane that may be uncertain_m off
  double good_margin_m = 0.05;  ///< distance from an edge from which on `margin` costs nothing
  double uncertain_m = 0.01;    ///< standard deviation of the plane's offset at which `uncertainty` is full
};

/// A robot on two legs. The step limits hold for the foot that is put down, seen from the one that stands:
/// its reference point in the standing foot's heading, level. Smaller than an Atlas's (IHMC's planner gives
/// it 0.55 m, widths 0.16 to 0.40 m and 0.28 m of height): so that robots of a man's size keep them slowly.
struct Biped {
  ContactShape foot = ContactShape::rectangle(0.22, 0.11);  ///< the sole
  ContactLimits contact = limits();                         ///< what a foothold needs
  double max_forward_m = 0.35;                              ///< of a step, ahead
  double max_backward_m = 0.15;                             ///< of a step, back
  double min_width_m = 0.15;                                ///< 4 cm between soles 11 cm wide
  double stance_width_m = 0.22;                             ///< between its feet when it stands
  double max_width_m = 0.35;                                ///< of a step, sideward
  double max_up_m = 0.22;    ///< of a step; building codes end risers at 0.18 to 0.21 m
  double max_down_m = 0.22;  ///< likewise
  double max_turn_rad = 25 * std::numbers::pi / 180;  ///< of one foot against the other
  double lift_m = 0.10;  ///< of the swinging foot over the higher of the two footholds beside it
  /// Where it would touch something so, a tread's edge beside the standing foot, say: over the highest step.
  double high_lift_m = 0.25;
  BodyBox body{0.30, 0.50, 0.45, 1.60};  ///< of trunk and thighs
  StepCosts costs;                       ///< which plan is best

  /// Half a voxel of 2 cm about foot and shin, because outlines and voxels are known no better: a sole then
  /// overhangs a true edge by a centimetre at most; no gaps under the sole; room for the shin up to where the
  /// body's box begins.
  static ContactLimits limits();
  void validate() const;  ///< throws Error(usage) naming field, value and rule
};

/// A robot on four legs with balls for feet, which crawls: one foot at a time, always three on the ground and
/// its middle over their triangle. Sizes of an ANYmal.
struct Quadruped {
  ContactShape foot = ContactShape::disc(0.03);  ///< what of the ball touches
  ContactLimits contact = limits();              ///< what a foothold needs
  double stance_length_m = 0.60;                 ///< between fore and hind feet when it stands
  double stance_width_m = 0.40;                  ///< between left and right ones
  double max_step_m = 0.15;                      ///< by which the body advances while each foot steps once
  double max_sideward_m = 0.10;                  ///< likewise to a side, and back
  double max_turn_rad = 25 * std::numbers::pi / 180;  ///< likewise of its heading
  double max_up_m = 0.22;                             ///< of one foot's step
  double max_down_m = 0.22;                           ///< likewise
  double reach_m = 0.20;                              ///< level, of a foot from below its hip
  double snap_m = 0.10;                               ///< how far from below its hip a foothold is looked for
  double max_sway_m = 0.12;        ///< of the body from its straight way, to get over a triangle of support
  double support_margin_m = 0.03;  ///< of the body's middle inside that triangle
  double lift_m = 0.10;            ///< as a biped's
  double high_lift_m = 0.25;       ///< as a biped's
  BodyBox body{0.80, 0.45, 0.20, 0.60};  ///< of the trunk
  StepCosts costs;                       ///< which plan is best

  static ContactLimits limits();  ///< as a biped's
  void validate() const;          ///< throws Error(usage) naming field, value and rule
};

/// What plans are made for.
using Robot = std::variant<Biped, Quadruped>;

/// Where a robot stands: the ground between its feet, map frame, and its heading about up, counter-clockwise
/// from the map's x axis (of the map turned upright(up), up.hpp).
struct Standing {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< map frame
  double yaw_rad = 0;                            ///< heading
};

/// When to stop. A result depends on the numbers of expansions alone, unless the time runs out first.
struct PlanBudget {
  std::size_t expansions = 20000;  ///< to find a plan at all; some 2 s where none is found
  std::size_t improving = 200;     ///< after the first plan, to find better ones
  std::optional<double> time_s;    ///< of all search of one call; checked at each expansion
};

/// One foot put down.
struct Footstep {
  FootName foot = FootName::left;                                ///< which foot
  SurfaceId surface = 0;                                         ///< the surface it stands on
  Eigen::Isometry3d T_map_foot = Eigen::Isometry3d::Identity();  ///< reference point, z along the normal
  double yaw_rad = 0;                                            ///< as Standing's
  double margin_m = 0;  ///< from the sole to the surface's nearest edge
};

/// What kept a step from being made.
enum class StepRefusal {
  reach,      ///< a foothold is there, but too far, too wide or too narrow, or turned too much
  height,     ///< it is within reach, but too high or too low
  clearance,  ///< the swinging foot, the other foot or the body would touch something
  support     ///< there is no foothold
};
/// By StepRefusal.
inline constexpr std::array<std::string_view, 4> step_refusal_names{"reach", "height", "clearance",
                                                                    "support"};
/// As in files: "reach", "height", …
constexpr std::string_view step_refusal_name(StepRefusal refusal) {
  return step_refusal_names[static_cast<std::size_t>(refusal)];
}

/// Why there is no plan.
struct NoPlan {
  /// What the search ended with.
  enum class Why {
    start,        ///< the robot cannot stand there
    goal,         ///< likewise
    unreachable,  ///< all it can get to was looked at, or all from where it could get to the goal: in vain
    budget        ///< the search was ended by its budget
  } why = Why::unreachable;  ///< what the search ended with
  std::string sentence;      ///< one line
  /// Of start and goal: which limit keeps the foot from standing there, if there is a surface.
  std::optional<ContactRefusal> contact;
  /// Of unreachable and budget: where it came nearest to the goal. Of start and goal: the nearest place
  /// within 2 m where it can stand with the same heading. Map frame.
  std::optional<Eigen::Vector3d> nearest;
  double nearest_m = 0;  ///< from there to the goal, or to the start
  /// How many footholds nearer to the goal, and within twice its reach from `nearest`, each limit refused, by
  /// StepRefusal.
  std::array<std::size_t, step_refusal_names.size()> refused{};
};

/// Footsteps from one standing to another, or why there are none.
struct FootstepPlan {
  std::vector<Footstep> start;  ///< where the feet stand at first
  std::vector<Footstep> steps;  ///< one after the other
  /// The body's pose at first and after each step: a biped's with half a stance to the foot put down last, on
  /// that foot's ground; a quadruped's while it takes the step. In between a biped's goes straight.
  std::vector<Standing> body;
  double cost = 0;  ///< of all steps, by StepCosts
  /// No plan of footholds on the planner's grid costs less than this; where it is `cost`, the plan is
  /// optimal.
  double lower_bound = 0;
  std::size_t expansions = 0;     ///< standings that were looked at
  double prepare_ms = 0;          ///< contact regions and voxels that no earlier plan had asked for
  double search_ms = 0;           ///< all the rest
  std::optional<NoPlan> refusal;  ///< empty: there is a plan

  /// Whether there is a plan.
  bool found() const { return !refusal; }
};

/// Plans footsteps over the surfaces of one snapshot.
///
/// 1. Footholds are the reference points of contact_region()s, in 16 headings that follow the directions in
///    which the surfaces' edges run, one in each cell of 5 cm: that with the largest margin on a grid of
///    1.25 cm, so regions narrower than that may be missed. Each one of a plan is accepted by foothold().
/// 2. A swinging biped's foot is lifted by lift_m over the higher of the two footholds beside it, or else by
///    high_lift_m, moved level past the standing foot and lowered; leg and foot, and the body on its straight
///    way from step to step, touch no occupied voxel. Unknown space counts as free.
/// 3. Statics only: no forces, no dynamics, no friction but by max_slope; knees and hips by step limits only.
///    The quadruped crawls: its body's poses are on the grid, its feet beside them at the best foothold, so a
///    way that needs other footholds for the same pose is not found.
/// 4. Weighted A* begun anew with smaller weights (Richter, Thayer and Ruml, "The joy of forgetting", 2010):
///    a first plan soon, better ones until the budget ends or the best is proven.
/// 5. Deterministic for a given budget without time limit.
/// What it finds out about the map (regions, voxels, steps) it keeps for later plans; not for two threads at
/// once. Throws Error(usage) for robots and places that make no sense.
class FootstepPlanner {
 public:
  /// `contact.up` of the robot tells which way is up. `edges`: label_edges() by surface, for limits that ask
  /// for them; may be empty.
  FootstepPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, Robot robot,
                  std::map<SurfaceId, std::vector<PolygonEdges>> edges = {});
  FootstepPlanner(FootstepPlanner&&) noexcept;
  FootstepPlanner& operator=(FootstepPlanner&&) noexcept;
  ~FootstepPlanner();

  /// At both ends the feet are put on the footholds nearest to where the robot would have them, within 10 cm
  /// (25 cm of height, for a quadruped; 20 cm for a biped), in the nearest heading.
  FootstepPlan plan(const Standing& from, const Standing& to, const PlanBudget& budget = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Judges every step of a biped's or quadruped's plan anew, with foothold(), the step limits and the octree,
/// and none of the planner's tables. Returns what is wrong, one sentence each; nothing if all is well.
std::vector<std::string> verify_plan(const FootstepPlan& plan, const Snapshot& snapshot,
                                     const OccupancyView& octree, const Robot& robot,
                                     const std::map<SurfaceId, std::vector<PolygonEdges>>& edges = {});

}  // namespace octosurf
