#pragma once

#include <octosurf/surface.hpp>

namespace octosurf {

/// Whether `after` is a later state of `before`: everything in `before` is in `after` or was removed since,
/// and nothing else is as old.
bool goes_on_from(const Snapshot& after, const Snapshot& before);

}  // namespace octosurf
