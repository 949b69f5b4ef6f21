#include "footsteps/swing.hpp"

#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::footsteps {
namespace {

constexpr double between_samples = 0.04;  // m; boxes are enlarged by half of it on every side

}  // namespace

double turn_between(double from_rad, double to_rad) {
  const double turn = (to_rad - from_rad) / (2 * std::numbers::pi);
  return (turn - std::floor(turn + 0.5)) * 2 * std::numbers::pi;
}

LegBox LegBox::of(const ContactShape& shape) {
  if (shape.outline.empty()) return {{0, 0}, shape.radius, shape.radius};
  const Eigen::AlignedBox2d box = planning::box_of(shape.outline);
  return {box.center(), box.sizes().x() / 2, box.sizes().y() / 2};
}

bool sweep_free(ObstacleColumns& columns, const LegBox& box, const SwingPose& from, const SwingPose& to,
                double from_z, double to_z, double climb, const Eigen::Vector2d& rise) {
  const double turn = turn_between(from.yaw_rad, to.yaw_rad);
  const double half_length = box.half_length + between_samples / 2,
               half_width = box.half_width + between_samples / 2;
  const auto middle_at = [&](const SwingPose& pose) {
    return box.middle.isZero() ? pose.at : pose.at + Eigen::Rotation2Dd(pose.yaw_rad) * box.middle;
  };
  if (rise.isZero()) {
    // A box around all positions: in its initial orientation, enlarged by the motion of its middle and its
    // corners. It is usually free, and then no samples are needed.
    const double most = std::min(std::abs(turn), std::numbers::pi);
    // A corner rotated by up to 90° extends along a side by at most the other side's share.
    const double sine = std::sin(std::min(most, std::numbers::pi / 2));
    const Eigen::Vector2d way = to.at - from.at;
    const Eigen::Vector2d half_way = (Eigen::Rotation2Dd(-from.yaw_rad) * way).cwiseAbs() / 2;
    const double swing = box.middle.norm() * 2 * std::sin(most / 2);
    if (!columns.blocked({middle_at(from) + way / 2, from.yaw_rad,
                          half_length + half_width * sine + half_way.x() + swing,
                          half_width + half_length * sine + half_way.y() + swing,
                          from_z + std::min(0.0, climb), to_z + std::max(0.0, climb)}))
      return true;
  }
  const double corner = box.middle.norm() + std::hypot(box.half_length, box.half_width);
  const double way = (to.at - from.at).norm() + std::abs(turn) * corner;
  const int count = static_cast<int>(std::ceil(way / between_samples));
  for (int i = 0; i <= count; ++i) {
    const double share = count == 0 ? 1 : static_cast<double>(i) / count, z = share * climb;
    const SwingPose pose{from.at + share * (to.at - from.at), from.yaw_rad + share * turn};
    if (columns.blocked({middle_at(pose), pose.yaw_rad, half_length, half_width, from_z + z, to_z + z, rise}))
      return false;
  }
  return true;
}

bool UnknownSpace::met(const LegBox& box, const SwingPose& from, const SwingPose& to, double from_z,
                       double to_z) {
  const double turn = turn_between(from.yaw_rad, to.yaw_rad);
  const double corner = box.middle.norm() + std::hypot(box.half_length, box.half_width);
  const Eigen::Vector2d low = from.at.cwiseMin(to.at).array() - corner,
                        high = from.at.cwiseMax(to.at).array() + corner;
  const Eigen::AlignedBox3d swept(Eigen::Vector3d(low.x(), low.y(), from_z),
                                  Eigen::Vector3d(high.x(), high.y(), to_z));
  const double step = voxels_.resolution(), way = (to.at - from.at).norm() + std::abs(turn) * corner;
  const int count = static_cast<int>(std::ceil(way / std::max(step, 1e-3)));
  const auto passes = [&](const Eigen::Vector2d& p) {
    for (int i = 0; i <= count; ++i) {
      const double share = count == 0 ? 1 : static_cast<double>(i) / count;
      const Eigen::Vector2d off = p - from.at - share * (to.at - from.at);
      if (off.squaredNorm() > (corner + step) * (corner + step)) continue;
      const Eigen::Vector2d in_leg =
          (Eigen::Rotation2Dd(-(from.yaw_rad + share * turn)) * off - box.middle).cwiseAbs();
      if (in_leg.x() <= box.half_length + step / 2 && in_leg.y() <= box.half_width + step / 2) return true;
    }
    return false;
  };
  bool met = false;
  voxels_.for_each(swept.transformed(Eigen::Isometry3d(R_walk_map_.transpose())),
                   [&](const Eigen::Vector3d& centre) {
                     if (met) return;
                     const Eigen::Vector3d p = R_walk_map_ * centre;
                     met = p.z() >= from_z && p.z() <= to_z && passes(p.head<2>());
                   });
  return met;
}

}  // namespace octosurf::footsteps
