#pragma once

#include <cstdint>

namespace octosurf {

using SurfaceId = std::uint64_t;  ///< 1 … 2⁵³−1, never reused; 0: none. A double holds every one exactly
using CylinderId = std::uint64_t;                               ///< likewise, separate from surface ids
inline constexpr SurfaceId last_id = (SurfaceId{1} << 53) - 1;  ///< of either

}  // namespace octosurf
