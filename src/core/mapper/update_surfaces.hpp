#pragma once

#include "detection/detector.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// The points that are segmented: of the waiting ones those that have their turn in a scan (waiting.hpp), or
/// all of them; or all points of the map, replacing its surfaces.
enum class Effort { turn, all, anew };

/// Steps 4 to 8 of a scan (docs/design.md §4), for every change of the octree: finds the surfaces of the
/// ledger's unprocessed points. Counts and times are added to the report. Cost follows the unprocessed and
/// waiting points.
void update_surfaces(surfaces::Ledger& ledger, const detection::Detector& detector, Effort effort,
                     ScanReport& report);

}  // namespace octosurf::mapper
