#pragma once

#include <algorithm>
#include <vector>

namespace octosurf::geometry {

/// The middle value, of an even number the upper of the two; reorders the values, which are not empty. O(n).
template <class T>
T median_of(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Standard deviation of normal values in medians of how far they lie off their middle.
inline constexpr double deviation_per_median = 1.4826;

}  // namespace octosurf::geometry
