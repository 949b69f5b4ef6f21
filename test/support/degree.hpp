#pragma once

#include <numbers>

namespace octosurf::test {

inline constexpr double degree = std::numbers::pi / 180;  ///< rad

}  // namespace octosurf::test
