#include "surfaces/plane_estimate.hpp"

#include "geometry/symmetric.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::surfaces {
namespace {

/// Squared systematic offset of the inliers' points from the plane along its normal, beyond their random
/// error: rays free the voxels before a plane, not those behind it, and a voxel behind that noise reached
/// once counts as much as one that each scan hits. Repeated observations are weighted by their number, so the
/// difference of the two reveals it.
double offset_bias(const geometry::ReadingGroup& inliers, const geometry::ReadingGroup& repeated,
                   const Eigen::Vector3d& normal) {
  if (!(inliers.about.count > 0 && repeated.about.count > 0)) return 0;
  double chance = 0;
  for (const geometry::ReadingGroup* group : {&inliers, &repeated})
    chance += normal.dot(group->about.covariance() * normal) / std::max(1.0, group->readings);
  const double difference = normal.dot(inliers.about.mean() - repeated.about.mean());
  const double share = inliers.about.count / (inliers.about.count + repeated.about.count);
  return share * share * std::max(0.0, difference * difference - chance);
}

}  // namespace

PlaneEstimate::PlaneEstimate(const Plane& plane, const Eigen::Vector3d& reference) {
  state_.plane = plane;
  state_.reference = reference;
  state_.pose.linear() = geometry::plane_axes(plane.normal);
  state_.pose.translation() = reference - plane.signed_distance(reference) * plane.normal;
}

PlaneEstimate::PlaneEstimate(const State& state) : state_(state) {
  size_ = static_cast<std::size_t>(moments(nullptr).count);
}

void PlaneEstimate::set_plane(const Plane& plane) {
  Eigen::Isometry3d& pose = state_.pose;
  pose.linear() =
      (geometry::rotation_between(state_.plane.normal, plane.normal) * Eigen::Quaterniond(pose.linear()))
          .normalized()
          .toRotationMatrix();
  pose.linear().col(2) = plane.normal;
  pose.linear().col(0) = pose.linear().col(1).cross(plane.normal).normalized();
  pose.linear().col(1) = plane.normal.cross(pose.linear().col(0));
  pose.translation() -= plane.signed_distance(pose.translation()) * plane.normal;
  state_.plane = plane;
}

void PlaneEstimate::add(const Eigen::Vector3f& position, unsigned range_class) {
  state_.moments[range_class].add(position.cast<double>() - state_.reference);
  ++size_;
}

void PlaneEstimate::remove(const Eigen::Vector3f& position, unsigned range_class) {
  state_.moments[range_class].add(position.cast<double>() - state_.reference, -1);
  // The inlier's part of the evidence is unknown, so an average share is removed.
  fade(1 - 1 / static_cast<double>(size_));
  --size_;
}

void PlaneEstimate::observe(const Eigen::Vector3f& position, double weight) {
  constexpr double max_readings = 100;  // per inlier
  state_.evidence.moments.add(position.cast<double>() - state_.reference, weight);
  if (++state_.evidence.readings > max_readings * static_cast<double>(size_)) fade(0.5);
}

void PlaneEstimate::take_evidence(const PlaneEstimate& other) {
  state_.evidence.moments.add(other.evidence().moments.shifted(reference() - other.reference()));
  state_.evidence.readings += other.evidence().readings;
}

void PlaneEstimate::fade(double share) {
  geometry::Moments faded;
  faded.add(state_.evidence.moments, share);
  state_.evidence = {faded, share * state_.evidence.readings};
}

geometry::Moments PlaneEstimate::moments(const sensing::NoiseModel* noise) const {
  geometry::Moments sum;
  for (unsigned c = 0; c < sensing::NoiseModel::classes; ++c) {
    if (moments_of_class(c).count <= 0) continue;
    // Weighted as the evidence: by the measured noise relative to the nearest class's allowed noise.
    const double ratio = noise != nullptr ? noise->sigma(1) / noise->measured_sigma(c) : 1;
    sum.add(moments_of_class(c), ratio * ratio);
  }
  if (noise != nullptr) sum.add(evidence().moments);
  return sum;
}

Plane PlaneEstimate::estimate(const sensing::NoiseModel& noise) const {
  return geometry::fitted_plane(moments(&noise), reference(), plane().normal);
}

double PlaneEstimate::rms() const {
  const Eigen::Vector3d& normal = plane().normal;
  return std::sqrt(moments(nullptr).mean_squared_distance(normal, plane().offset - normal.dot(reference())));
}

/// The inliers' own points and the repeated observations, about the origin of the surface's frame.
std::array<geometry::ReadingGroup, 2> PlaneEstimate::reading_groups(const sensing::NoiseModel& noise) const {
  const Eigen::Vector3d origin = pose().translation() - reference();
  geometry::Moments kept = moments(&noise);
  kept.add(evidence().moments, -1);
  return {{{kept.shifted(origin), static_cast<double>(size_)},
           {evidence().moments.shifted(origin), evidence().readings}}};
}

Eigen::Matrix3d PlaneEstimate::covariance_of_readings(const sensing::NoiseModel& noise) const {
  const Eigen::Matrix3d c = geometry::covariance_over(reading_groups(noise), pose().linear().transpose());
  constexpr std::array<int, 3> slopes_first{1, 2, 0};
  return ((c + c.transpose()) / 2)(slopes_first, slopes_first);
}

void PlaneEstimate::derive_covariance(const sensing::NoiseModel& noise) {
  state_.covariance = covariance_of_readings(noise);
  const auto [inliers, repeated] = reading_groups(noise);
  state_.covariance(2, 2) += offset_bias(inliers, repeated, plane().normal);
}

}  // namespace octosurf::surfaces
