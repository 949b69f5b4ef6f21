#include "checkpoints.hpp"

#include "output_files.hpp"
#include "run_statistics.hpp"

#include <cstdio>
#include <new>

#include <octosurf/error.hpp>

namespace octosurf {

Checkpoints::Checkpoints(std::string stem, double period_s, bool force)
    : stem_(std::move(stem)), period_s_(period_s), force_(force), known_(version()) {}

Checkpoints::Version Checkpoints::version() const {
  std::error_code failure;
  const std::filesystem::path file = files_of_map(stem_).front();
  const auto time = std::filesystem::last_write_time(file, failure);
  if (failure) return {};
  return std::pair(std::filesystem::file_size(file, failure), time);
}

void Checkpoints::save(const Map& map, std::size_t scans, const KeptScans& kept) {
  if (const Version now = version(); !force_ && now && now != known_)
    throw Error(Error::Kind::output, files_of_map(stem_).front(),
                "was written by another since this run began", "move it elsewhere before this run ends");
  RunContext().warn(save_map(map, stem_, kept));
  known_ = version();
  scans_ = scans;
  any_ = true;
  failing_ = false;
}

void Checkpoints::try_to_save(const Map& map, std::size_t scans, const KeptScans& kept) try {
  save(map, scans, kept);
} catch (const std::exception& error) {  // no space or no memory: the next one may succeed
  if (failing_) return;
  failing_ = true;
  std::fprintf(stderr, "warning: no checkpoint of %zu scans, %s; %s, the run goes on\n", scans,
               reason_of(error), last().c_str());
}

std::string Checkpoints::last() const {
  if (!any_) return "no checkpoint of this run was complete";
  return "the last complete checkpoint is " + stem_ + " with " + std::to_string(scans_) +
         " scans of this run";
}

const char* reason_of(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ? "out of memory" : error.what();
}

}  // namespace octosurf
