#pragma once

#include <cstdint>

namespace octosurf {

using SurfaceId = std::uint32_t;   ///< 1 … 2²⁴−1, never reused; 0 is "none yet"
using CylinderId = std::uint32_t;  ///< 1 …, numbered apart from surfaces, never reused; 0 is "none"

}  // namespace octosurf
