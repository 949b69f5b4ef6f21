#pragma once

#include "detection/refusal.hpp"
#include "surfaces/scan_changes.hpp"

#include <string>
#include <vector>

#include <octosurf/explain.hpp>

namespace octosurf {

/// A refusal as its reader meets it.
struct StatedReason {
  Reason reason = Reason::waiting;
  std::string sentence;
  std::vector<Figure> figures;
  SurfaceId surface = 0;
  CylinderId cylinder = 0;
};

StatedReason reason_for(const Refused& refused);  ///< does not look at its points
StatedReason reason_for(const Unsound& dissolved);
StatedReason on_cylinder(CylinderId cylinder);
StatedReason not_flat(double curvature, double limit);
StatedReason no_normal();
/// Of a point that detection would take now: `accumulated` points wait for a run, which needs `n`.
StatedReason waiting(double accumulated, double n);

/// Of a place that the reason needs no numbers for; `surface` where it is about one.
std::string sentence_of(Reason reason, SurfaceId surface = 0);

}  // namespace octosurf
