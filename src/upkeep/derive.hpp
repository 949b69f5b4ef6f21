#pragma once

#include "surfaces/scan_changes.hpp"

#include <memory>

namespace octosurf {

/// Recomputes what is stale of the touched surfaces. Returns the next snapshot, for whoever publishes it.
std::shared_ptr<const Snapshot> derive(Workspace& work);

}  // namespace octosurf
