#pragma once

#include "checkpoints.hpp"
#include "map_options.hpp"
#include "run_statistics.hpp"

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {

/// What a run of `octosurf map` has reached, for all that take part in it.
struct RunState {
  using Clock = std::chrono::steady_clock;

  /// `begin_time`: of the whole run, reading of the map that it resumes included.
  RunState(const MapOptions& map_options, Map start, RunContext run_context, Clock::time_point begin_time)
      : options(map_options),
        mapper(std::move(start), options.threads, paper_detector()),
        statistics(mapper.map().parameters()),
        context(std::move(run_context)),
        checkpoints(options.output, options.checkpoint_s, options.force && options.resume.empty()),
        begin(begin_time) {
    mapper.remember_scans();
  }

  const MapOptions& options;
  Mapper mapper;
  RunStatistics statistics;
  RunContext context;
  Checkpoints checkpoints;
  std::size_t scans_listed = 0;  ///< by the input; bad ones and those that --skip and --first leave out count
  ScanFeed* feed = nullptr;      ///< while scans are inserted
  bool changed = false;          ///< the map, by this run
  bool saving_last = false;      ///< the last save has begun
  std::optional<double> last_stamp_s;  ///< of the scans that were inserted
  std::vector<std::string> written;    ///< files and folders, for the summary

  double now_s() const { return std::chrono::duration<double>(Clock::now() - begin).count(); }
  /// Throws Error(data): the run is not worth saving, and nothing is written.
  [[noreturn]] void refuse(const std::string& what, const std::string& hint) {
    changed = false;
    throw Error(Error::Kind::data, context.input.empty() ? "" : context.input.front(),
                what + "; nothing is written", hint);
  }

 private:
  Clock::time_point begin;
};

}  // namespace octosurf
