#include "run_state.hpp"

#include <utility>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>

namespace octosurf {

RunState::RunState(const MapOptions& map_options, Map start, RunContext run_context,
                   Clock::time_point begin_time)
    : options(map_options),
      mapper(std::move(start), options.threads, paper_detector()),
      statistics(mapper.map().parameters()),
      context(std::move(run_context)),
      checkpoints(options.output, options.checkpoint_s, options.force && options.resume.empty()),
      begin(begin_time) {
  mapper.remember_scans();
}

void RunState::refuse(const std::string& what, const std::string& hint) {
  changed = false;
  throw Error(Error::Kind::data, context.input.empty() ? "" : context.input.front(),
              what + "; nothing is written", hint);
}

}  // namespace octosurf
