#pragma once

#include "detection/refusal.hpp"
#include "surfaces/changes.hpp"

#include <string>
#include <vector>

#include <octosurf/explain.hpp>

namespace octosurf {

/// A refusal as its reader meets it.
struct Verdict {
  Reason reason = Reason::waiting;
  std::string sentence;
  std::vector<Figure> figures;
  SurfaceId surface = 0;
  CylinderId cylinder = 0;
};

Verdict verdict_of(const Refused& refused);  ///< does not look at its points
Verdict verdict_of(const Unsound& dissolved);
Verdict on_cylinder(CylinderId cylinder);
Verdict not_flat(double curvature, double limit);
Verdict no_normal();
/// Of a point that detection would take now: `accumulated` points wait for a run, which needs `n`.
Verdict waiting(double accumulated, double n);

/// Of a place that the reason needs no numbers for; `surface` where it is about one.
std::string sentence_of(Reason reason, SurfaceId surface = 0);

}  // namespace octosurf
