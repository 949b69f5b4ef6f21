#include "body_path.hpp"

#include <algorithm>
#include <cmath>
#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <numbers>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/spaces/SE2StateSpace.h>
#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <octosurf/adapters/octree.hpp>

namespace octosurf::examples {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

constexpr double ground_cell = 0.025;  // m; a crack between two treads' outlines is narrower than three cells
constexpr double between_samples = 0.10;  // m, of the ground under the body: no tread is so short
constexpr double between_states = 0.02;   // m of a path that are checked: a voxel's edge

BodyState state_of(const ob::State* state) {
  const auto* at = state->as<ob::SE2StateSpace::StateType>();
  return {at->getX(), at->getY(), at->getYaw()};
}

ob::ScopedState<ob::SE2StateSpace> state_in(const ob::StateSpacePtr& space, const BodyState& state) {
  ob::ScopedState<ob::SE2StateSpace> result(space);
  result->setXY(state.x, state.y);
  result->setYaw(std::remainder(state.yaw_rad, 2 * std::numbers::pi));
  return result;
}

/// All of the ground, and every heading.
ob::StateSpacePtr space_over(const HeightGrid& ground) {
  auto space = std::make_shared<ob::SE2StateSpace>();
  const Eigen::Vector2d half(ground.cell * static_cast<double>(ground.elevation.rows()) / 2,
                             ground.cell * static_cast<double>(ground.elevation.cols()) / 2);
  ob::RealVectorBounds bounds(2);
  for (unsigned i = 0; i < 2; ++i) {
    bounds.setLow(i, ground.center[i] - half[i]);
    bounds.setHigh(i, ground.center[i] + half[i]);
  }
  space->setBounds(bounds);
  // OMPL checks a motion in steps of a share of the space's extent.
  space->setLongestValidSegmentFraction(between_states / space->getMaximumExtent());
  return space;
}

}  // namespace

BodyPlanner::BodyPlanner(const Snapshot& snapshot, const OccupancyView& octree, const Body& body)
    : octree_(std::make_shared<fcl::OcTreed>(std::shared_ptr<const octomap::OcTree>(to_octree(octree)))),
      body_(body) {
  HeightGridOptions options;
  options.cell = ground_cell;
  ground_ = height_grid(snapshot, options);
}

// The highest of the cells about a point: where a foot would stand, and no crack is a hole.
std::optional<double> BodyPlanner::height(double x, double y) const {
  const Eigen::Index rows = ground_.elevation.rows(), columns = ground_.elevation.cols();
  const Eigen::Vector2d from_corner =
      Eigen::Vector2d(static_cast<double>(rows), static_cast<double>(columns)) / 2 -
      (Eigen::Vector2d(x, y) - ground_.center) / ground_.cell;
  const auto row = static_cast<Eigen::Index>(std::floor(from_corner.x()));
  const auto column = static_cast<Eigen::Index>(std::floor(from_corner.y()));
  std::optional<double> highest;
  for (Eigen::Index r = std::max<Eigen::Index>(0, row - 1); r <= std::min(rows - 1, row + 1); ++r)
    for (Eigen::Index c = std::max<Eigen::Index>(0, column - 1); c <= std::min(columns - 1, column + 1);
         ++c) {
      const double z = ground_.elevation(r, c);
      if (std::isfinite(z) && (!highest || z > *highest)) highest = z;
    }
  return highest;
}

std::optional<Eigen::Isometry3d> BodyPlanner::pose(const BodyState& state) const {
  const Eigen::Rotation2Dd turn(state.yaw_rad);
  const int along = static_cast<int>(std::ceil(body_.length_m / between_samples)),
            across = static_cast<int>(std::ceil(body_.width_m / between_samples));
  // Heights over the body's own x and y, and the plane z = c + a·x + b·y through them with the least squares.
  Eigen::MatrixXd heights(along + 1, across + 1);
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (int i = 0; i <= along; ++i) {
    for (int j = 0; j <= across; ++j) {
      const Eigen::Vector2d own((static_cast<double>(i) / along - 0.5) * body_.length_m,
                                (static_cast<double>(j) / across - 0.5) * body_.width_m);
      const Eigen::Vector2d at = Eigen::Vector2d(state.x, state.y) + turn * own;
      const std::optional<double> z = height(at.x(), at.y());
      if (!z) return std::nullopt;
      if (i > 0 && std::abs(*z - heights(i - 1, j)) > body_.max_rise_m) return std::nullopt;
      if (j > 0 && std::abs(*z - heights(i, j - 1)) > body_.max_rise_m) return std::nullopt;
      heights(i, j) = *z;
      const Eigen::Vector3d row(1, own.x(), own.y());
      normal_matrix += row * row.transpose();
      right_side += *z * row;
    }
  }
  const Eigen::Vector3d plane = normal_matrix.ldlt().solve(right_side);
  if (std::hypot(plane[1], plane[2]) > std::tan(body_.max_slope_rad)) return std::nullopt;
  Eigen::Matrix3d axes;  // x as the heading, on the plane
  axes.col(0) = Eigen::Vector3d(1, 0, plane[1]).normalized();
  axes.col(2) = Eigen::Vector3d(-plane[1], -plane[2], 1).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(state.x, state.y, plane[0]);
  T.linear() = Eigen::AngleAxisd(state.yaw_rad, Eigen::Vector3d::UnitZ()) * axes;
  return T;
}

bool BodyPlanner::stands(const BodyState& state) const {
  const std::optional<Eigen::Isometry3d> T = pose(state);
  if (!T) return false;
  const double twice = 2 * body_.margin_m;
  fcl::CollisionObjectd trunk(std::make_shared<fcl::Boxd>(body_.length_m + twice, body_.width_m + twice,
                                                          body_.to_m - body_.from_m + twice),
                              *T * Eigen::Translation3d(0, 0, (body_.from_m + body_.to_m) / 2));
  fcl::CollisionResultd result;
  return fcl::collide(&octree_, &trunk, fcl::CollisionRequestd(), result) == 0;
}

BodyPath BodyPlanner::plan(const BodyState& from, const BodyState& to, std::uint32_t seed,
                           unsigned iterations) const {
  if (!stands(from)) return {{}, {}, "the body cannot be at the start"};
  if (!stands(to)) return {{}, {}, "the body cannot be at the goal"};
  ompl::msg::noOutputHandler();
  ompl::RNG::setSeed(seed);
  const ob::StateSpacePtr space = space_over(ground_);
  const auto information = std::make_shared<ob::SpaceInformation>(space);
  information->setStateValidityChecker([this](const ob::State* state) { return stands(state_of(state)); });
  const auto problem = std::make_shared<ob::ProblemDefinition>(information);
  problem->setStartAndGoalStates(state_in(space, from), state_in(space, to));
  og::RRTConnect planner(information);
  planner.setProblemDefinition(problem);
  planner.setup();
  ob::IterationTerminationCondition enough(iterations);
  if (planner.solve(enough) != ob::PlannerStatus::EXACT_SOLUTION)
    return {{}, {}, "no path in " + std::to_string(iterations) + " iterations"};
  og::PathGeometric& path = *problem->getSolutionPath()->as<og::PathGeometric>();
  og::PathSimplifier(information).reduceVertices(path);
  path.interpolate();  // to the very states that were checked
  BodyPath result;
  for (const ob::State* state : path.getStates()) {
    result.states.push_back(state_of(state));
    result.poses.push_back(pose(result.states.back()).value());
  }
  return result;
}

}  // namespace octosurf::examples
