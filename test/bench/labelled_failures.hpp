#pragma once

#include "bench/labelled_methods.hpp"

namespace octosurf::bench {

/// A table of the judged labels that the first segmentation has not correct: what the label's plane is
/// like, who holds its points, and which of the other segmentations have it correct. Empty if there is none.
std::string failure_table(const VoxelCloud& cloud, const std::vector<Segmentation>& segmentations);

}  // namespace octosurf::bench
