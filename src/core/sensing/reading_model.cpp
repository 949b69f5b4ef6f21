#include "sensing/reading_model.hpp"

#include <numbers>

namespace octosurf::sensing {

ReadingModel::ReadingModel(const NoiseModel& noise, double resolution) {
  for (unsigned c = 0; c < NoiseModel::classes; ++c) along_sight_[c] = noise.reading_variance(c);
  const double step = resolution / 256;  // of a point in its voxel (sensing/reading_code.hpp)
  common_ = step * step / 12 + pose_sigma * pose_sigma;
  pose_variance_ = std::max(pose_sigma * pose_sigma, noise.surface_variance());
  log_scale_ = log_odds + std::log(clutter_depth / std::sqrt(2 * std::numbers::pi));
  if (noise.stated_tolerance()) set_reach(*noise.stated_tolerance());
  for (unsigned c = 0; c < NoiseModel::classes; ++c) farthest2_[c] = reach(c, 1) * reach(c, 1);
}

void ReadingModel::set_reach(double reach_m) {
  // The reach grows with the variance up to 0.48 m², where readings can hardly be separated from clutter.
  constexpr double smallest = 1e-12, largest = 0.48;  // m²
  const double nearest = along_sight_[1];
  double low = smallest, high = largest;
  while (high > 1.0001 * low) {
    along_sight_[1] = std::sqrt(low * high);
    (reach(1, 1) < reach_m ? low : high) = along_sight_[1];
  }
  along_sight_[1] = nearest;
  // Where residuals make the nearest class the worst, no other gets less than its stated variance.
  for (double& variance : along_sight_) variance = high + std::max(0.0, variance - nearest);
}

}  // namespace octosurf::sensing
