#pragma once

#include "occupancy/point_window.hpp"
#include "surfaces/refusal.hpp"

#include <vector>

namespace octosurf {

/// Points that detection leaves pending, and why.
struct Refused {
  Refusal why;
  std::vector<PointWindow::Index> points;
};

}  // namespace octosurf
