#pragma once

#include "run_statistics.hpp"

#include <octosurf/map.hpp>

namespace octosurf {

/// To stderr, after a run's summary: what about its poses, its sensor and its surfaces the user should look
/// at. `reported`: there is a report, which lists the double layers.
void print_warnings(const RunStatistics& statistics, const Map& map, bool reported);

}  // namespace octosurf
