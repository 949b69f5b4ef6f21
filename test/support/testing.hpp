// What most tests include: the standard library, Eigen, GoogleTest's matchers, the seed and what is thrown.
#pragma once

#include "support/seed.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/parameters.hpp>

namespace octosurf::test {

inline constexpr double degree = std::numbers::pi / 180;  ///< rad

/// True under the address or the thread sanitizer: they reserve terabytes of address space, count memory in
/// their own malloc and slow everything down several times.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// As by default, of voxels of so many metres.
inline Parameters of_voxels(double resolution, bool align = true) {
  Parameters parameters;
  parameters.occupancy.resolution = resolution;
  parameters.align = align;
  return parameters;
}

}  // namespace octosurf::test
