#pragma once

#include "run_state.hpp"

namespace octosurf {

/// Prints on stdout what a run has mapped, dropped, found and written.
void print_summary(const RunState& run);

}  // namespace octosurf
