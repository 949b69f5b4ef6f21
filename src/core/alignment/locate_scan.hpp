#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/pose_fit.hpp"
#include "sensing/noise_model.hpp"

#include <memory>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Localizer's algorithm, with the scan's known noise and further errors of its points.
Alignment locate_scan(const Snapshot& map, NearSurfaces& surfaces, const Scan& scan,
                      const sensing::NoiseModel& noise, const AlignmentReach& reach,
                      const FitErrors& errors = {});

/// Throws Error(usage) for an empty map or an invalid reach.
void require_reach(const std::shared_ptr<const Snapshot>& map, const AlignmentReach& reach);

}  // namespace octosurf::alignment
