#pragma once

#include "run_state.hpp"

#include <memory>

namespace octosurf {

class RunObserver;

/// `map --serve`: serves the map while it grows, from threads that leave the processor to the mapper, and
/// prints the address. Answers are of the latest snapshot; the mapper never waits for them. Throws as
/// HttpServer.
std::unique_ptr<RunObserver> live_view(RunState& run);

}  // namespace octosurf
