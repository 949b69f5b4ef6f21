#include "detection/patch.hpp"

#include "detection/constants.hpp"
#include "geometry/plane_covariance.hpp"
#include "geometry/plane_frame.hpp"

#include <numbers>

namespace octosurf::detection {
void Patch::add(const Patch& other) {
  moments.add(other.moments.shifted(origin - other.origin));
  readings += other.readings;
  hits += other.hits;
  log_peaks += other.log_peaks;
}

void Patch::take(const Patch& other) {
  add(other);
  fit();
}

void Patch::fit() { plane = geometry::fitted_plane(moments, origin, plane.normal); }

double Patch::chi2(const Plane& to) const {
  return moments.count * moments.mean_squared_distance(to.normal, to.offset - to.normal.dot(origin));
}

Heights heights_over(const Patch& patch, const Eigen::Vector3d& at, const Eigen::Matrix3d& R) {
  const geometry::Moments about = patch.moments.shifted(at - patch.origin);
  Eigen::Matrix3d normal = geometry::normal_matrix(about, R);
  // Readings in a line do not determine the slope across it: prior of standard deviation 1.
  normal.diagonal().tail<2>().array() += 1;
  const Eigen::Vector3d n = R * patch.plane.normal;
  const double offset = patch.plane.offset - patch.plane.normal.dot(at);
  Heights heights;
  heights.theta = Eigen::Vector3d(offset, -n.x(), -n.y()) / n.z();
  heights.covariance = (1 + about.count * patch.pose_variance) * normal.inverse();
  return heights;
}

PlanePair::PlanePair(const Patch& a, const Patch& b)
    : R_(geometry::plane_axes((a.plane.normal + b.plane.normal).normalized()).transpose()),
      about_(0.5 * (a.centroid() + b.centroid())) {
  const Heights ha = heights_over(a, about_, R_), hb = heights_over(b, about_, R_);
  D_ = ha.theta - hb.theta;
  C_ = ha.covariance + hb.covariance;
  const Eigen::LDLT<Eigen::Matrix3d> solver(C_);
  const double log_determinant = solver.vectorD().array().max(1e-300).log().sum();
  const double log_one =
      -0.5 * (3 * std::log(2 * std::numbers::pi) + log_determinant + D_.dot(solver.solve(D_)));
  const double slope2 = D_.tail<2>().squaredNorm() + 0.5 * (C_(1, 1) + C_(2, 2));
  const double log_two =
      -std::log(2 * Constants::log_scales) - std::log(2 * std::numbers::pi * slope2 * Constants::log_scales);
  log_ratio_ = log_one - log_two;
}

double PlanePair::log_same(const Eigen::Vector3d& at) const {
  Eigen::Vector3d here =
      R_ * (at - about_);  // D and C give the step there as (1, u, v) · D, and its variance
  here = {1, here.x(), here.y()};
  const double step = here.dot(D_);
  return log_ratio_ + 0.5 * std::log(step * step + here.dot(C_ * here));
}

double log_tail(const Patch& a, const Patch& b) {
  const double often = (a.hits / a.readings) / (b.hits / b.readings);
  return -0.5 * (b.chi2(a.plane) - b.chi2(b.plane)) + b.readings * std::log1p(often) + description_cost(b);
}

double description_cost(const Patch& patch) {
  const Eigen::Matrix3d R = geometry::plane_axes(patch.plane.normal).transpose();
  const Eigen::Matrix3d C = heights_over(patch, patch.centroid(), R).covariance;
  const double allowed = std::sqrt((2 * std::numbers::pi * C).determinant());
  const double all = sensing::ReadingModel::clutter_depth * 2 * std::numbers::pi;  // offsets; directions
  return std::log(all / allowed) + Constants::log_places;
}

}  // namespace octosurf::detection
