#pragma once

#include <octosurf/surface.hpp>

namespace octosurf::test {

/// m², of the surfaces of one map where another of the same place has none of about the same normal, over or
/// under them within twice the coarser d: sampled on a grid of that.
double unshared_area(const Snapshot& one, const Snapshot& other);

double area_of(const Snapshot& snapshot);  ///< m²

}  // namespace octosurf::test
