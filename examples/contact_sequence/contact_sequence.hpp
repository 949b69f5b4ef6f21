#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <octosurf/planner_formats.hpp>

namespace octosurf::examples {

/// A convex place for a foot's reference point: A·p ≤ b in the world, its plane as the last two rows.
struct ContactPiece {
  octosurf::SurfaceId surface = 0;
  std::vector<Eigen::Vector3d> vertices;
  Eigen::Matrix<double, Eigen::Dynamic, 3> A;
  Eigen::VectorXd b;
};

/// The surfaces' convex pieces, in their world.
std::vector<ContactPiece> contact_pieces(const std::vector<PlannerSurface>& surfaces);

/// A biped by boxes: where a foot may be put, seen from the one that stands, and where the centre of mass may
/// be, seen from a foot; forward, outward (to the moving foot's side), up. Reach as Biped's in footsteps.hpp.
struct BipedReach {
  Eigen::Vector3d step_low{-0.15, 0.15, -0.22}, step_high{0.35, 0.35, 0.22};
  Eigen::Vector3d center_low{-0.35, -0.35, 0.70}, center_high{0.35, 0.35, 1.00};
  /// How far from the standing foot's reference point the centre of mass may be while the other foot is in
  /// the air: half a sole of 0.22 m × 0.11 m, and half of that again to spare.
  Eigen::Vector2d balance{0.055, 0.0275};
  double stance_width_m = 0.22;
};

struct ContactTask {
  std::array<Eigen::Vector3d, 2> start;         ///< left and right foot; the left one steps first
  Eigen::Vector3d goal;                         ///< the middle between the feet at the end
  Eigen::Vector3d tolerance{0.10, 0.10, 0.05};  ///< of the goal: forward, left, up
  double yaw_rad = 0;                           ///< of the feet, all the way
};

struct ContactSequence {
  struct Step {
    std::size_t piece = 0;
    Eigen::Vector3d foot = Eigen::Vector3d::Zero();
    Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of mass, while the foot is in the air
  };
  std::vector<Step> steps;  ///< left, right, left, …
};

/// Contacts from start to goal in as few steps as will do, at most `most`: SL1M's problem (Tonneau et al.,
/// "SL1M: Sparse L1-norm minimization for contact planning on uneven terrain", 2020) as the mixed-integer
/// programme that it relaxes, solved to the end by CBC. Which piece a foot is put on is one binary choice per
/// step, everything else is linear:
///
/// 1. Each foot lies in its piece: A·p ≤ b, to 1e-5 m.
/// 2. It is in reach of the foot that stands, and both are in reach of the centre of mass.
/// 3. While a foot is in the air the robot stands statically on the other one: the centre of mass is over it.
///    Between two such postures it moves straight, over the hull of both soles.
/// 4. Of all plans of the fewest steps it is one whose feet are nearest to the stance's width apart.
/// The world's z is up.
/// Empty: CBC has proven that no plan has so few steps.
///
/// CBC, and not GLPK, which Debian has, too: both solve each of these programmes of some hundred binaries in
/// tenths of a second, but GLPK's licence (GPL 3) would bind every program that is made of this example,
/// CBC's (EPL 2) binds none.
std::optional<ContactSequence> plan_contacts(const std::vector<ContactPiece>& pieces, const ContactTask& task,
                                             const BipedReach& reach, std::size_t most);

}  // namespace octosurf::examples
