#include "footsteps/verify_plan.hpp"

#include "footsteps/gait.hpp"
#include "geometry/even_odd.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"
#include "planning/unknown_space.hpp"
#include "planning/voxel_matter.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include <octosurf/up.hpp>

// Boxes are tested against the octree itself, every centimetre; its voxels are read as by the planner.

namespace octosurf::test {
namespace {

constexpr double plan_rounding = 1e-6;  // m
constexpr double sample = 0.01;         // m

struct LevelPose {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  double yaw = 0;
  double z = 0;
};

Eigen::Vector2d ahead_of(double yaw) { return {std::cos(yaw), std::sin(yaw)}; }
Eigen::Vector2d left_of(double yaw) { return {-std::sin(yaw), std::cos(yaw)}; }

struct Judge {
  const Snapshot& snapshot;
  const OccupancyView& octree;
  const footsteps::Gait gait;
  Eigen::Matrix3d R_walk_map = Eigen::Matrix3d::Identity();
  std::vector<std::string> wrong{};
  std::string where{};

  void say(const std::string& what) { wrong.push_back(where + ": " + what); }

  LevelPose level(const Footstep& step) const {
    const Eigen::Vector3d p = R_walk_map * step.T_map_foot.translation();
    return {p.head<2>(), step.yaw_rad, p.z()};
  }
  LevelPose level(const Standing& standing) const {
    const Eigen::Vector3d p = R_walk_map * standing.at;
    return {p.head<2>(), standing.yaw_rad, p.z()};
  }

  void stands(const Footstep& step) {
    const Surface* surface = snapshot.find(step.surface);
    if (surface == nullptr) return say("its surface is not there");
    const Foothold hold = foothold(*surface, gait.sole, step.T_map_foot.translation(), step.yaw_rad,
                                   gait.contact, &octree, &snapshot);
    if (!hold.accepted) say("the foothold is refused: " + std::string(contact_refusal_name(*hold.refused)));
    if (!hold.T_map_contact.isApprox(step.T_map_foot, 1e-6)) say("the foot is not on its plane");
  }

  /// Whether a box at a pose, between two heights, holds the middle of something occupied, or (`unknown`) of
  /// an unknown voxel in which something could hide.
  bool holds(bool unknown, const LevelPose& pose, const footsteps::LegBox& box, double from_z, double to_z,
             const Eigen::Vector2d& rise = Eigen::Vector2d::Zero()) const {
    const Eigen::Matrix2d R = Eigen::Rotation2Dd(pose.yaw).toRotationMatrix();
    const Eigen::Vector2d center = pose.at + R * box.middle, half(box.half_length, box.half_width);
    bool found = false;
    const auto look = [&](const Eigen::Vector3d& in_map) {
      const Eigen::Vector3d p = R_walk_map * in_map;
      const Eigen::Vector2d off = p.head<2>() - center;
      const double z = p.z() - rise.dot(off);
      found =
          found || (((R.transpose() * off).cwiseAbs() - half).maxCoeff() <= 0 && z >= from_z && z <= to_z);
      return !found;
    };
    const Eigen::Vector3d reach(half.norm(), half.norm(), half.norm() * rise.norm());
    const Eigen::AlignedBox3d upright(Eigen::Vector3d(center.x(), center.y(), from_z) - reach,
                                      Eigen::Vector3d(center.x(), center.y(), to_z) + reach);
    const Eigen::AlignedBox3d around = upright.transformed(Eigen::Isometry3d(R_walk_map.transpose()));
    planning::MatterOfVoxels matter_of(&snapshot, octree.resolution());
    if (unknown)
      planning::for_each_unknown(octree, around, look);
    else
      octree.for_each_occupied(
          planning::box_about(around, planning::MatterOfVoxels::farthest_move),
          [&](const OccupancyView::Voxel& voxel) { return look(matter_of(voxel).middle); });
    return found;
  }

  bool body_occupied(const LevelPose& pose, const Eigen::Vector2d& rise = Eigen::Vector2d::Zero()) const {
    const BodyBox& body = gait.body;
    return holds(false, pose, {{0, 0}, body.length_m / 2, body.width_m / 2}, pose.z + body.from_m,
                 pose.z + body.to_m, rise);
  }

  template <class Visit>
  void along(const LevelPose& from, const LevelPose& to, const Visit& visit) const {
    const double turn = std::remainder(to.yaw - from.yaw, 2 * std::numbers::pi);
    const int count =
        std::max(1, static_cast<int>(std::ceil(((to.at - from.at).norm() + 0.2 * std::abs(turn)) / sample)));
    for (int i = 0; i <= count; ++i) {
      const double share = static_cast<double>(i) / count;
      visit(LevelPose{from.at + share * (to.at - from.at), from.yaw + share * turn,
                      from.z + share * (to.z - from.z)});
    }
  }

  void leg_moves(const LevelPose& from, const LevelPose& to, double ground) {
    const footsteps::LegBox leg = footsteps::LegBox::of(gait.sole);
    const auto hits = [&](double height, bool unknown) {
      bool hit = false;
      along(from, to, [&](const LevelPose& pose) {
        hit = hit || holds(unknown, pose, leg, ground + height, ground + std::max(height, gait.lift.hip));
      });
      return hit;
    };
    bool touches = true, passes_unknown = false;
    for (const double height : {gait.lift.usual, gait.lift.high}) {
      if (hits(height, false)) continue;
      touches = false;
      passes_unknown = gait.contact.unknown_to_m > 0 && hits(height, true);
      if (!passes_unknown) break;
    }
    if (touches) say("the swinging leg touches something");
    if (passes_unknown) say("the swinging leg passes unknown space");
  }

  void body_moves(const LevelPose& from, const LevelPose& to) {
    bool hit = false;
    along(from, to, [&](const LevelPose& pose) { hit = hit || body_occupied(pose); });
    if (hit) say("the body touches something");
  }

  // Above the plane through four feet.
  void body_stands(const LevelPose& pose, const std::array<Footstep, 4>& feet) {
    Eigen::Matrix<double, 4, 3> A;
    Eigen::Vector4d z;
    for (int i = 0; i < 4; ++i) {
      const LevelPose foot_pose = level(feet[static_cast<std::size_t>(i)]);
      A.row(i) << foot_pose.at.x() - pose.at.x(), foot_pose.at.y() - pose.at.y(), 1;
      z[i] = foot_pose.z;
    }
    const Eigen::Vector3d plane = A.colPivHouseholderQr().solve(z);
    if (std::abs(plane.z() - pose.z) > plan_rounding) say("the body's height is not that over its feet");
    if (body_occupied(pose, plane.head<2>())) say("the body touches something");
  }

  void within(const char* what, double value, double least, double most) {
    if (value >= least - plan_rounding && value <= most + plan_rounding) return;
    char text[120];
    std::snprintf(text, sizeof text, "%s of %.3f is not in %.3f … %.3f", what, value, least, most);
    say(text);
  }
};

int side_of(const Footstep& step) { return step.foot == FootName::left ? 1 : -1; }

Ring2 outline_at(const LevelPose& pose, const ContactShape& foot) {
  Ring2 ring;
  for (const Eigen::Vector2d& p : foot.outline)
    ring.push_back(pose.at + p.x() * ahead_of(pose.yaw) + p.y() * left_of(pose.yaw));
  return ring;
}

// Some point of one less some point of the other is 0.
bool overlap(const Ring2& a, const Ring2& b) {
  return !a.empty() && geometry::inside(planning::minkowski_sum(a, planning::mirrored(b)), {0, 0});
}

void judge(const FootstepPlan& plan, const Biped& robot, Judge& judge) {
  judge.where = "start";
  if (plan.start.size() != 2) return judge.say("a biped has two feet");
  for (const Footstep& foot : plan.start) judge.stands(foot);
  if (plan.steps.empty()) return;
  std::array<Footstep, 2> feet{plan.start[0], plan.start[1]};  // left, right
  if (side_of(feet[0]) < 0) std::swap(feet[0], feet[1]);
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    const Footstep& step = plan.steps[i];
    judge.where = "step " + std::to_string(i + 1);
    judge.stands(step);
    if (i > 0 && step.foot == plan.steps[i - 1].foot) judge.say("it is of the same foot as the one before");
    const int side = side_of(step);
    const LevelPose stance = judge.level(feet[side > 0 ? 1 : 0]),
                    before = judge.level(feet[side > 0 ? 0 : 1]), after = judge.level(step);
    const Eigen::Vector2d d = after.at - stance.at;
    judge.within("length", d.dot(ahead_of(stance.yaw)), -robot.max_backward_m, robot.max_forward_m);
    judge.within("width", side * d.dot(left_of(stance.yaw)), robot.min_width_m, robot.max_width_m);
    judge.within("height", after.z - stance.z, -robot.max_down_m, robot.max_up_m);
    judge.within("turn", std::remainder(after.yaw - stance.yaw, 2 * std::numbers::pi), -robot.max_turn_rad,
                 robot.max_turn_rad);
    if (overlap(outline_at(stance, robot.foot), outline_at(after, robot.foot)))
      judge.say("the soles overlap");
    const LevelPose beside{stance.at + side * robot.stance_width_m * left_of(stance.yaw), stance.yaw, 0};
    const double lifted = std::max(before.z, stance.z), lowered = std::max(stance.z, after.z);
    judge.leg_moves(before, beside, lifted);
    judge.leg_moves(beside, after, lowered);
    const auto body_over = [&](const LevelPose& foot, int foot_side) {
      return LevelPose{foot.at - foot_side * robot.stance_width_m / 2 * left_of(foot.yaw), foot.yaw, foot.z};
    };
    judge.body_moves(body_over(stance, -side), body_over(after, side));
    feet[side > 0 ? 0 : 1] = step;
  }
}

void judge(const FootstepPlan& plan, const Quadruped& robot, Judge& judge) {
  judge.where = "start";
  if (plan.start.size() != 4) return judge.say("a quadruped has four feet");
  for (const Footstep& foot : plan.start) judge.stands(foot);
  if (plan.body.size() != plan.steps.size() + 1) return judge.say("there is not a body's pose for each step");
  std::array<Footstep, 4> feet;  // by FootName
  const auto index_of = [](const Footstep& step) {
    return static_cast<std::size_t>(step.foot) - static_cast<std::size_t>(FootName::front_left);
  };
  for (const Footstep& foot : plan.start) feet.at(index_of(foot)) = foot;
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    const Footstep& step = plan.steps[i];
    judge.where = "step " + std::to_string(i + 1);
    judge.stands(step);
    const LevelPose body = judge.level(plan.body[i + 1]);
    const LevelPose before = judge.level(feet.at(index_of(step))), after = judge.level(step);
    judge.within("height", after.z - before.z, -robot.max_down_m, robot.max_up_m);
    const auto from_hip = [&](const LevelPose& foot, std::size_t k) {
      const double forward = (k < 2 ? 1 : -1) * robot.stance_length_m / 2;
      const double left = (k % 2 == 0 ? 1 : -1) * robot.stance_width_m / 2;
      return (foot.at - body.at - forward * ahead_of(body.yaw) - left * left_of(body.yaw)).norm();
    };
    judge.within("reach", from_hip(after, index_of(step)), 0, robot.reach_m);
    Ring2 stand;
    for (const std::size_t k : {0, 2, 3, 1}) {  // counter-clockwise
      judge.within("reach", from_hip(judge.level(feet[k]), k), 0, robot.reach_m);
      if (k != index_of(step)) stand.push_back(judge.level(feet[k]).at);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d edge = (stand[(k + 1) % 3] - stand[k]).normalized(), d = body.at - stand[k];
      judge.within("support", edge.x() * d.y() - edge.y() * d.x(), robot.support_margin_m, HUGE_VAL);
    }
    judge.leg_moves(before, after, std::max(before.z, after.z));
    judge.body_stands(body, feet);
    feet.at(index_of(step)) = step;
  }
}

}  // namespace

std::vector<std::string> verify_plan(const FootstepPlan& plan, const Snapshot& snapshot,
                                     const OccupancyView& octree, const Robot& robot) {
  return std::visit(
      [&](const auto& kind) {
        Judge verdict{snapshot, octree, footsteps::gait_of(kind)};
        verdict.R_walk_map = upright(kind.contact.up).toRotationMatrix();
        if (plan.found()) judge(plan, kind, verdict);
        return verdict.wrong;
      },
      robot);
}

}  // namespace octosurf::test
