#pragma once

#include "run_state.hpp"

#include <filesystem>
#include <memory>

namespace octosurf {

/// Refuses a run of whose readings hardly any were mapped.
void require_readings(RunState& run);

/// Refuses a run that goes on with a map most of whose scans contradict it.
void require_same_frame(RunState& run);

/// Of a run that is over: its report, its summary, and its warnings. `kept_scans`: their folder, or empty.
void report(RunState& run, const std::filesystem::path& kept_scans);

/// `map --serve`: while it lives, serves the map that grows, from threads that leave the processor to the
/// mapper. Prints the address. Answers are of the latest snapshot; the mapper never waits for them. Throws as
/// HttpServer.
std::shared_ptr<const void> live_view(RunState& run);

}  // namespace octosurf
