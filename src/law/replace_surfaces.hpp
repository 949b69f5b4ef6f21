#pragma once

#include "surfaces/ledger.hpp"

namespace octosurf::law {

/// Dissolves all surfaces and makes those that segment() finds among all of the octree's points, owned and
/// pending. Each goes on with what later scans told of a surface before, if nine tenths of that one's points
/// are its own, and names those as parents; what became of a former surface is noted with the one that has
/// the most of its points. No point waits for detection then. `noise_factor2`: as for ReadingModel.
void replace_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree, double noise_factor2);

}  // namespace octosurf::law
