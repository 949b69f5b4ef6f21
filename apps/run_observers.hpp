#pragma once

#include "run_state.hpp"
#include "scan_keeper.hpp"

#include <memory>
#include <vector>

namespace octosurf {

using RunObservers = std::vector<std::unique_ptr<RunObserver>>;

/// Refuses a run of whose readings hardly any were mapped.
void require_readings(RunState& run);

/// What writes or serves the outputs of a run, in the order of saving: first what a saved map refers to, then
/// the map, then what describes it, the report and the summary last. `kept`: where the scans of the map that
/// the run starts from are, and its own will be. Throws what prevents an output.
RunObservers outputs_of(RunState& run, KeptScans kept);

/// `map --serve`: serves the map while it grows, from threads that leave the processor to the mapper, and
/// prints the address. Answers are of the latest snapshot; the mapper never waits for them. Throws as
/// HttpServer.
std::unique_ptr<RunObserver> live_view(RunState& run);

}  // namespace octosurf
