#pragma once

#include "parameter_options.hpp"
#include "scan_feed.hpp"

#include <optional>
#include <string>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace octosurf {

/// Options of `octosurf map`.
struct MapOptions {
  std::vector<std::string> inputs;
  std::string output, resume, report;   ///< stems of maps; file
  std::string keep_scans, write_poses;  ///< folder; file
  ParameterOptions parameters;
  ScanSourceOptions source;
  ScanRange range;
  double checkpoint_s = 60;                  ///< 0: never
  std::optional<unsigned short> serve_port;  ///< of this machine, to serve the map while it grows
  int threads = 1;
  bool realtime = false, force = false;
  bool strict = false;  ///< no map of scans that contradict one another
};

}  // namespace octosurf
