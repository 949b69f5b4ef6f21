#pragma once

#include "occupancy/point_window.hpp"
#include "surfaces/refusal.hpp"

#include <functional>
#include <span>

namespace octosurf {

/// Points that detection leaves pending, and why.
struct Refused {
  Refusal why;
  std::span<const PointWindow::Index> points;
};

/// Called for each rejection during detection. If a point is rejected more than once, the first rejection is
/// reported.
using RefusalSink = std::function<void(const Refused&)>;

}  // namespace octosurf
