#include "footsteps/swing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::footsteps {
namespace {

constexpr double between_samples = 0.04;  // m; boxes are enlarged by half of it on every side

// Calls visit(pose, share) from one pose to the other, at most between_samples apart.
template <class Visit>
bool all_free(const SwingPose& from, const SwingPose& to, double half_diagonal, Visit&& visit) {
  const double turn = turn_between(from.yaw_rad, to.yaw_rad);
  const double way = (to.at - from.at).norm() + std::abs(turn) * half_diagonal;
  const int count = static_cast<int>(std::ceil(way / between_samples));
  for (int i = 0; i <= count; ++i) {
    const double share = count == 0 ? 1 : static_cast<double>(i) / count;
    if (!visit(SwingPose{from.at + share * (to.at - from.at), from.yaw_rad + share * turn}, share))
      return false;
  }
  return true;
}

// A box around all positions of a box between two poses: in its initial orientation, enlarged by the motion
// of its middle and its corners. It is usually free, and then no samples are needed.
UprightBox about(const SwingPose& from, const SwingPose& to, const Eigen::Vector2d& middle,
                 double half_length, double half_width) {
  const Eigen::Rotation2Dd turned(from.yaw_rad);
  const double turn = std::abs(turn_between(from.yaw_rad, to.yaw_rad));
  // A corner rotated by up to 90° extends along a side by at most the other side's share.
  const double sine = std::sin(std::min(turn, std::numbers::pi / 2));
  const Eigen::Vector2d half_way = (turned.inverse() * (to.at - from.at)).cwiseAbs() / 2;
  const double swing = middle.norm() * 2 * std::sin(std::min(turn, std::numbers::pi) / 2);
  UprightBox box;
  box.center = (from.at + to.at) / 2 + turned * middle;
  box.yaw_rad = from.yaw_rad;
  box.half_length = half_length + half_width * sine + half_way.x() + swing;
  box.half_width = half_width + half_length * sine + half_way.y() + swing;
  return box;
}

}  // namespace

double turn_between(double from_rad, double to_rad) {
  const double turn = (to_rad - from_rad) / (2 * std::numbers::pi);
  return (turn - std::floor(turn + 0.5)) * 2 * std::numbers::pi;
}

LegBox LegBox::of(const ContactShape& shape) {
  if (shape.outline.empty()) return {{0, 0}, shape.radius, shape.radius};
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : shape.outline) box.extend(p);
  return {box.center(), box.sizes().x() / 2, box.sizes().y() / 2};
}

bool sweep_free(ObstacleColumns& columns, const LegBox& leg, const SwingPose& from, const SwingPose& to,
                double from_z, double to_z) {
  const double half_diagonal = leg.middle.norm() + std::hypot(leg.half_length, leg.half_width);
  UprightBox all = about(from, to, leg.middle, leg.half_length + between_samples / 2,
                         leg.half_width + between_samples / 2);
  all.from_z = from_z;
  all.to_z = to_z;
  if (!columns.blocked(all)) return true;
  return all_free(from, to, half_diagonal, [&](const SwingPose& at, double) {
    const Eigen::Vector2d middle =
        leg.middle.isZero() ? at.at : at.at + Eigen::Rotation2Dd(at.yaw_rad) * leg.middle;
    return !columns.blocked({middle, at.yaw_rad, leg.half_length + between_samples / 2,
                             leg.half_width + between_samples / 2, from_z, to_z});
  });
}

bool swing_free(ObstacleColumns& columns, const LegBox& leg, const SwingPose& from, const SwingPose& to,
                double ground, const Lift& lift) {
  for (const double height : {lift.usual, lift.high})
    if (sweep_free(columns, leg, from, to, ground + height, ground + std::max(height, lift.hip))) return true;
  return false;
}

bool body_sweep_free(ObstacleColumns& columns, const BodyBox& body, const SwingPose& from, double from_ground,
                     const SwingPose& to, double to_ground, const Eigen::Vector2d& rise) {
  const double half_diagonal = std::hypot(body.length_m, body.width_m) / 2;
  if (rise.isZero()) {
    UprightBox all = about(from, to, Eigen::Vector2d::Zero(), (body.length_m + between_samples) / 2,
                           (body.width_m + between_samples) / 2);
    all.from_z = std::min(from_ground, to_ground) + body.from_m;
    all.to_z = std::max(from_ground, to_ground) + body.to_m;
    if (!columns.blocked(all)) return true;
  }
  return all_free(from, to, half_diagonal, [&](const SwingPose& at, double share) {
    const double ground = from_ground + share * (to_ground - from_ground);
    return !columns.blocked({at.at, at.yaw_rad, (body.length_m + between_samples) / 2,
                             (body.width_m + between_samples) / 2, ground + body.from_m, ground + body.to_m,
                             rise});
  });
}

}  // namespace octosurf::footsteps
