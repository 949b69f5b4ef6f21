#pragma once

#include "scan_feed.hpp"

namespace CLI {
class App;
}

namespace octosurf {

/// The options that say how scans are read, and which of them are taken.
void add_scan_options(CLI::App& verb, ScanSourceOptions& source, ScanRange& range);

}  // namespace octosurf
