#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// The foot of a step. A biped has the first two, a quadruped the other four.
enum class FootName { left, right, front_left, front_right, hind_left, hind_right };
/// By FootName.
inline constexpr std::array<std::string_view, 6> foot_names{"left",        "right",     "front_left",
                                                            "front_right", "hind_left", "hind_right"};
/// As in files: "left", "right", "front_left", …
constexpr std::string_view foot_name(FootName foot) { return foot_names[static_cast<std::size_t>(foot)]; }

/// The collision box of a robot's trunk, about the middle between its feet. A biped's is upright; a
/// quadruped's is aligned with the plane through its four feet, because an upright one would hit steps ahead:
/// its heights are over that plane.
struct BodyBox {
  double length_m = 0;  ///< along its heading
  double width_m = 0;   ///< across
  double from_m = 0;    ///< above the ground; anything lower is left to the legs
  double to_m = 0;      ///< above the ground under it
};

/// Penalties added to a step's base cost of 1. A step at the limit in every respect costs as much as three
/// good ones: worth a detour of two steps.
struct StepCosts {
  double length = 0.5;          ///< of the longest step; shorter ones in proportion
  double height = 0.5;          ///< of the highest step
  double turn = 0.3;            ///< of the widest turn
  double margin = 1.0;          ///< on an edge; zero from good_margin_m on
  double slope = 0.5;           ///< on the steepest slope
  double uncertainty = 0.5;     ///< on a plane whose offset has a standard deviation of uncertain_m
  double good_margin_m = 0.05;  ///< distance from an edge beyond which `margin` costs nothing
  double uncertain_m = 0.01;    ///< deviation of the plane's offset at which `uncertainty` counts fully
};

/// A robot on two legs. The step limits are for the swing foot's reference point relative to the stance foot,
/// in its heading, level. They are smaller than an Atlas's (IHMC's planner: 0.55 m length, 0.16 to 0.40 m
/// width, 0.28 m height), to suit slow walking of human-sized robots.
struct Biped {
  ContactShape foot = ContactShape::rectangle(0.22, 0.11);  ///< the sole
  ContactLimits contact = limits();                         ///< limits of a foothold
  double max_forward_m = 0.35;                              ///< of a step, forward
  double max_backward_m = 0.15;                             ///< of a step, backward
  double min_width_m = 0.15;                                ///< 4 cm between soles 11 cm wide
  double stance_width_m = 0.22;                             ///< between the feet in stance
  double max_width_m = 0.35;                                ///< of a step, sideward
  double max_up_m = 0.22;    ///< of a step; building codes end risers at 0.18 to 0.21 m
  double max_down_m = 0.22;  ///< likewise
  double max_turn_rad = 25 * std::numbers::pi / 180;  ///< of one foot against the other
  double lift_m = 0.10;  ///< clearance of the swing foot over the higher of the two footholds beside it
  /// Used if the swing foot would otherwise collide, e.g. with a tread's edge beside the stance foot:
  /// clearance over the highest step.
  double high_lift_m = 0.25;
  BodyBox body{0.30, 0.50, 0.45, 1.60};  ///< of trunk and thighs
  StepCosts costs;                       ///< weights for the best plan

  /// Half a voxel of 2 cm about foot and shin, because outlines and voxels are no more accurate: a sole then
  /// overhangs a true edge by a centimetre at most; no gaps under the sole; room for the shin up to the
  /// bottom of the body's box.
  static ContactLimits limits();
  void validate() const;  ///< throws Error(usage) naming field, value and rule
};

/// A robot on four legs with ball feet that crawls: one foot at a time, three on the ground and the body's
/// centre over their triangle. Sizes of an ANYmal.
struct Quadruped {
  ContactShape foot = ContactShape::disc(0.03);       ///< contact area of the ball
  ContactLimits contact = limits();                   ///< limits of a foothold
  double stance_length_m = 0.60;                      ///< between fore and hind feet in stance
  double stance_width_m = 0.40;                       ///< between left and right ones
  double max_step_m = 0.15;                           ///< advance of the body per gait cycle
  double max_sideward_m = 0.10;                       ///< likewise sideward and backward
  double max_turn_rad = 25 * std::numbers::pi / 180;  ///< likewise of its heading
  double max_up_m = 0.22;                             ///< of one foot's step
  double max_down_m = 0.22;                           ///< likewise
  double reach_m = 0.20;                              ///< horizontal, of a foot from below its hip
  double snap_m = 0.10;                               ///< search radius for a foothold below its hip
  double max_sway_m = 0.12;        ///< of the body off its straight path, to reach a triangle of support
  double support_margin_m = 0.03;  ///< of the body's centre inside that triangle
  double lift_m = 0.10;            ///< as a biped's
  double high_lift_m = 0.25;       ///< as a biped's
  BodyBox body{0.80, 0.45, 0.20, 0.60};  ///< of the trunk
  StepCosts costs;                       ///< weights for the best plan

  static ContactLimits limits();  ///< as a biped's
  void validate() const;          ///< throws Error(usage) naming field, value and rule
};

/// The robot to plan for.
using Robot = std::variant<Biped, Quadruped>;

/// A robot's stance: the ground point between its feet, map frame, and its heading about up,
/// counter-clockwise from the map's x axis (of the map turned by upright(up), up.hpp).
struct Standing {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< map frame
  double yaw_rad = 0;                            ///< heading
};

/// When to stop. A result depends on the numbers of expansions only, unless the time limit ends the search.
struct PlanBudget {
  std::size_t expansions = 20000;  ///< until the first plan; some 2 s if none is found
  std::size_t improving = 200;     ///< after the first plan, to improve it
  std::optional<double> time_s;    ///< for all searches of one call; checked at each expansion
};

/// One foot placement.
struct Footstep {
  FootName foot = FootName::left;                                ///< which foot
  SurfaceId surface = 0;                                         ///< the surface under it
  Eigen::Isometry3d T_map_foot = Eigen::Isometry3d::Identity();  ///< reference point, z along the normal
  double yaw_rad = 0;                                            ///< heading, as Standing's
  double margin_m = 0;  ///< from the sole to the surface's nearest edge
};

/// Why a step was rejected.
enum class StepRefusal {
  reach,      ///< a foothold exists, but too far, wide, narrow or turned
  height,     ///< within reach, but too high or too low
  clearance,  ///< the swing foot, the stance foot or the body would collide
  support,    ///< no foothold
  unknown     ///< the swing foot or its leg would pass where something unseen may be
};
/// By StepRefusal.
inline constexpr std::array<std::string_view, 5> step_refusal_names{"reach", "height", "clearance", "support",
                                                                    "unknown"};
/// As in files: "reach", "height", …
constexpr std::string_view step_refusal_name(StepRefusal refusal) {
  return step_refusal_names[static_cast<std::size_t>(refusal)];
}

/// Why no plan was found.
struct NoPlan {
  /// Category of the failure.
  enum class Why {
    start,                   ///< the robot cannot stand there
    goal,                    ///< likewise
    unreachable,             ///< all states that the start reaches, or that reach the goal, were tried
    budget                   ///< the budget was used up
  } why = Why::unreachable;  ///< category
  std::string sentence;      ///< one line
  /// Start and goal: the contact limit that prevents standing there, if there is a surface.
  std::optional<ContactRefusal> contact;
  /// Unreachable and budget: the place reached that is nearest to the goal. Start and goal: the nearest place
  /// within 2 m where it can stand with the same heading. Map frame.
  std::optional<Eigen::Vector3d> nearest;
  double nearest_m = 0;  ///< from there to the goal, or to the start
  /// Footholds nearer to the goal, and within twice its reach from `nearest`, that each limit rejected, by
  /// StepRefusal.
  std::array<std::size_t, step_refusal_names.size()> refused{};
};

/// Footsteps from one stance to another, or the reason why there are none.
struct FootstepPlan {
  std::vector<Footstep> start;  ///< initial foot placements
  std::vector<Footstep> steps;  ///< in order
  /// The body's pose at the start and after each step: a biped's half a stance beside the foot placed last,
  /// on that foot's ground; a quadruped's during the step. A biped's body moves straight in between.
  std::vector<Standing> body;
  double cost = 0;  ///< of all steps, by StepCosts
  /// Lower bound on the cost of any plan with footholds on the planner's grid, from what walking costs in
  /// free level space; a plan of this cost is optimal.
  double lower_bound = 0;
  std::size_t expansions = 0;     ///< expanded stances
  double search_ms = 0;           ///< of the call
  std::optional<NoPlan> refusal;  ///< empty: a plan was found

  /// Whether a plan was found.
  bool found() const { return !refusal; }
};

/// Plans footsteps over the surfaces of one snapshot.
///
/// 1. Footholds are the reference points of contact_region()s, in 16 headings aligned with the surfaces'
///    edges, one in each cell of 5 cm: the one with the largest margin on a grid of 1.25 cm, so narrower
///    regions may be missed. foothold() accepts each foothold of a plan.
/// 2. A biped's swing foot is lifted by lift_m over the higher of the two footholds beside it, or else by
///    high_lift_m, moved level past the stance foot and lowered; leg, foot and the body on its straight path
///    touch no occupied voxel. Leg and foot touch nothing unknown either, unless `contact.unknown_to_m` is 0;
///    for the body unknown space counts as free.
/// 3. Statics only: no forces, no dynamics, friction only as max_slope; knees and hips only as step limits.
///    The quadruped crawls: its body poses are on a grid, each with the best foothold per foot, so plans that
///    need other footholds for the same pose are missed.
/// 4. Weighted A*, restarted with decreasing weights (Richter, Thayer and Ruml, "The joy of forgetting",
///    2010): a first plan soon, then better ones until the budget ends or optimality is proven.
/// 5. Deterministic for a given budget without time limit.
/// Regions, voxels and steps are cached for later plans; not thread-safe. Throws Error(usage) for invalid
/// robots and places.
class FootstepPlanner {
 public:
  /// The robot's `contact.up` defines the up direction.
  FootstepPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, Robot robot);
  /// A planner for a later snapshot of the same map, which keeps what is as it was: voxels near which nothing
  /// changed, and the places for feet on unchanged surfaces. Headings stay those of the first.
  FootstepPlanner next(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree) const;
  FootstepPlanner(FootstepPlanner&&) noexcept;
  FootstepPlanner& operator=(FootstepPlanner&&) noexcept;
  ~FootstepPlanner();

  /// At both ends the feet are placed on the footholds nearest to their nominal positions, within 10 cm (of
  /// height: 25 cm for a quadruped, 20 cm for a biped), in the nearest heading.
  FootstepPlan plan(const Standing& from, const Standing& to, const PlanBudget& budget = {});

 private:
  struct Impl;
  explicit FootstepPlanner(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
