#include "detection/sure_plane.hpp"

#include "detection/constants.hpp"
#include "geometry/plane_frame.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::detection {

Patch patch_of(const surfaces::SurfaceModel& surface, const sensing::ReadingModel& model,
               const ClassMoments& without, const ClassCosines& least, double times) {
  Patch patch;
  patch.plane = surface.plane();
  patch.origin = surface.reference();
  patch.pose_variance = model.pose_variance();
  const double offset = patch.plane.offset - patch.plane.normal.dot(patch.origin);
  for (unsigned c = 0; c < sensing::NoiseModel::classes; ++c) {
    geometry::Moments moments = surface.moments_of_class(c);
    moments.add(without[c], -1);
    if (moments.count < 0.5) continue;
    const double variance = moments.mean_squared_distance(patch.plane.normal, offset);
    const double cosine = std::max(least[c], model.cos_incidence_of(c, variance));
    patch.moments.add(moments, times * model.weight(c, cosine));
    patch.log_peaks += times * moments.count * model.log_peak(c, cosine);
    patch.readings += times * moments.count;
  }
  patch.hits = patch.readings;
  return patch;
}

SurePlane::SurePlane(const Patch& patch, const sensing::ReadingModel& model)
    : model_(&model),
      plane_(patch.plane),
      R_(geometry::plane_axes(patch.plane.normal).transpose()),
      about_(patch.centroid()) {
  Patch independent = patch;
  independent.pose_variance = 0;  // shared by a point and its neighbours
  covariance_ = heights_over(independent, about_, R_).covariance;
}

double SurePlane::log_ratio(const occupancy::VoxelPoint& point) const {
  const Eigen::Vector3d position = point.position.cast<double>();
  const Eigen::Vector3d at = R_ * (position - about_), here(1, at.x(), at.y());
  const double unsure = Constants::plane_deviations * std::sqrt(std::max(0.0, here.dot(covariance_ * here)));
  return model_->log_ratio(std::fabs(plane_.signed_distance(position)) + unsure, point.range_class,
                           plane_.normal.dot(point.view.cast<double>()));
}

}  // namespace octosurf::detection
