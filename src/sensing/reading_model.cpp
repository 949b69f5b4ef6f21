#include "sensing/reading_model.hpp"

#include <numbers>

namespace octosurf::sensing {

ReadingModel::ReadingModel(const NoiseModel& noise, double resolution) {
  for (unsigned c = 0; c < NoiseModel::classes; ++c) along_sight_[c] = noise.reading_variance(c);
  const double step = resolution / 256;  // of a point in its voxel (sensing/reading_code.hpp)
  common_ = step * step / 12 + pose_sigma * pose_sigma;
  pose_variance_ = std::max(pose_sigma * pose_sigma, noise.surface_variance());
  log_scale_ = log_odds + std::log(clutter_depth / std::sqrt(2 * std::numbers::pi));
  for (unsigned c = 0; c < NoiseModel::classes; ++c) farthest2_[c] = reach(c, 1) * reach(c, 1);
}

}  // namespace octosurf::sensing
