#pragma once

#include <octosurf/explain.hpp>

namespace octosurf::surfaces {

/// Why points stay pending, with the numbers behind it.
struct Refusal {
  Reason reason = Reason::waiting;
  double measured = 0, limit = 0;  ///< the reason's figure and its bound; both 0: none
  SurfaceId surface = 0;           ///< the surface that causes it, if any
  CylinderId cylinder = 0;         ///< likewise
};

}  // namespace octosurf::surfaces
