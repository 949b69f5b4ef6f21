#pragma once

#include "run_state.hpp"
#include "scan_keeper.hpp"

#include <memory>
#include <vector>

namespace octosurf {

using RunObservers = std::vector<std::unique_ptr<RunObserver>>;

/// Thrown, before anything is written, where a camera's scans fit each other only if their poses are a
/// body's: x forward, z up (Meaning::of_body). The run is to begin anew with that.
struct PosesOfBody {};

/// What refuses a run whose map would be useless, or warns of it: wrong units, forms of poses, resolutions.
RunObservers checks_of(RunState& run);

/// What writes or serves the outputs of a run, in the order of saving: first what a saved map refers to, then
/// the map, then what describes it, the report and the summary last. `kept`: where the scans of the map that
/// the run starts from are, and its own will be. Throws what prevents an output.
RunObservers outputs_of(RunState& run, KeptScans kept);

/// `map --serve`: serves the map while it grows, from threads that leave the processor to the mapper, and
/// prints the address. Answers are of the latest snapshot; the mapper never waits for them. Throws as
/// HttpServer.
std::unique_ptr<RunObserver> live_view(RunState& run);

}  // namespace octosurf
