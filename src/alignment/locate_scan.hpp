#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/pose_fit.hpp"
#include "sensing/noise_model.hpp"

#include <memory>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// What Localizer does with a scan, with the noise that is known of it and what else its points may err by.
Alignment locate_scan(const Snapshot& map, NearSurfaces& surfaces, const Scan& scan,
                      const sensing::NoiseModel& noise, const AlignmentReach& reach,
                      const FitErrors& errors = {});

/// Throws Error(usage) for a map or a reach with which nothing can be found.
void require_reach(const std::shared_ptr<const Snapshot>& map, const AlignmentReach& reach);

}  // namespace octosurf::alignment
