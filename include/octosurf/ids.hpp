#pragma once

#include <cstdint>

namespace octosurf {

using SurfaceId = std::uint32_t;   ///< 1 … 2²⁴−1, never reused; 0: none
using CylinderId = std::uint32_t;  ///< 1 …, separate from surface ids, never reused; 0: none

}  // namespace octosurf
