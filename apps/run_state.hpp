#pragma once

#include "parameter_options.hpp"
#include "run_statistics.hpp"
#include "scan_feed.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {

/// Options of `octosurf map`; a run of `octosurf remap` has them, too.
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
  bool realtime = false, force = false, locate = false, no_up = false;
  bool strict = false;  ///< no map of scans that contradict one another
  std::string check;    ///< the command that finds out why they do
};

/// What a run of `octosurf map` has reached, for all that take part in it.
struct RunState {
  using Clock = std::chrono::steady_clock;

  const MapOptions& options;
  Mapper mapper;
  RunContext context;
  Clock::time_point begin;  ///< of the whole run, reading of the map that it resumes included
  RunStatistics statistics{mapper.map().parameters()};
  bool changed = false;  ///< the map, by this run

  double now_s() const { return std::chrono::duration<double>(Clock::now() - begin).count(); }
  /// Throws Error(data): the run is not worth saving, and nothing is written.
  [[noreturn]] void refuse(const std::string& what, const std::string& hint) {
    changed = false;
    throw Error(Error::Kind::data, context.input.empty() ? "" : context.input.front(),
                what + "; nothing is written", hint);
  }
};

}  // namespace octosurf
