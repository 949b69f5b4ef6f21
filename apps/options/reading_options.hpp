#pragma once

#include <octosurf/scan_source.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// Options of what readings are none, and of which sensor: also the ROS node's.
void add_reading_options(CLI::App& verb, ScanSourceOptions& source);

}  // namespace octosurf
