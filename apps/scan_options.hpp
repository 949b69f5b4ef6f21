#pragma once

#include "scan_feed.hpp"

namespace CLI {
class App;
}

namespace octosurf {

/// Options for reading and selecting scans.
void add_scan_options(CLI::App& verb, ScanSourceOptions& source, ScanRange& range);

}  // namespace octosurf
