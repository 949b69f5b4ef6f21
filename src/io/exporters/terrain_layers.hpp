#pragma once

#include <Eigen/Core>

namespace octosurf::io {

/// Every connected gap (NaN; neighbours share an edge) filled with the lowest height on its rim. All NaN
/// stays.
Eigen::MatrixXf without_gaps(Eigen::MatrixXf heights);

/// Each cell's mean over the square of `cells` cells about it, as far as the grid reaches; an even number
/// counts as the next one.
Eigen::MatrixXf mean_over(const Eigen::MatrixXf& heights, double cells);

}  // namespace octosurf::io
