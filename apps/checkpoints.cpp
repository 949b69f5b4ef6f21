#include "checkpoints.hpp"

#include "last_line.hpp"
#include "output_files.hpp"

#include <cstdio>

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
  save_map(map, stem_, kept);
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
  LastLine line;
  line.add("warning: no checkpoint of %zu scans, %s; ", scans, reason_of(error));
  line.add_last_of(*this);
  line.add(", the run goes on");
  std::fprintf(stderr, "%s\n", line.what());
}

}  // namespace octosurf
