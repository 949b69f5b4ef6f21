#pragma once

#include "surfaces/scan_changes.hpp"

namespace octosurf {

/// Recomputes what is stale of the touched surfaces and publishes a new snapshot.
void derive(Workspace& work);

}  // namespace octosurf
