#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace octosurf::cylinders {

/// Effort of RANSAC (Fischler & Bolles 1981).
struct RansacEffort {
  int iterations;           ///< maximum
  int drawn;                ///< points that span a model
  std::size_t scored;       ///< points that models are scored on
  std::size_t to_beat = 0;  ///< minimum number of inliers less one
};

template <class Model>
struct RansacBest {
  Model model;
  std::size_t inliers;
};

/// The model with most inliers. Stops once an outlier-free sample has been drawn with a probability of 99.9
/// %, by the share of inliers so far. `draw()` returns a model, or nothing for a degenerate sample;
/// `count(model, to_beat)` its inliers, or any number up to `to_beat` if there are no more than that.
template <class Model, class Draw, class Count>
std::optional<RansacBest<Model>> ransac(const RansacEffort& effort, Draw&& draw, Count&& count) {
  constexpr double confidence = 0.999;
  std::optional<RansacBest<Model>> best;
  std::size_t most = effort.to_beat;
  double needed = effort.iterations;
  for (int k = 0; k < effort.iterations && k < needed; ++k) {
    const std::optional<Model> model = draw();
    if (!model) continue;
    const std::size_t inliers = count(*model, most);
    if (inliers <= most) continue;
    most = inliers;
    best = {*model, inliers};
    const double share = static_cast<double>(most) / static_cast<double>(effort.scored);
    double all_good = 1;
    for (int p = 0; p < effort.drawn; ++p) all_good *= share;
    needed = std::log(1 - confidence) / std::log(1 - std::min(all_good, 1 - 1e-9));
  }
  return best;
}

}  // namespace octosurf::cylinders
