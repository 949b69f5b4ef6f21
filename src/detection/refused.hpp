#pragma once

#include "occupancy/point_window.hpp"
#include "surfaces/refusal.hpp"

#include <vector>

namespace octosurf::detection {

/// Points that detection leaves pending, and why.
struct Refused {
  surfaces::Refusal why;
  std::vector<occupancy::PointWindow::Index> points;
};

}  // namespace octosurf::detection
