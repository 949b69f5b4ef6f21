#include "checkpoints.hpp"

#include "io/map_file/map_file.hpp"
#include "output_files.hpp"
#include "run_statistics.hpp"

#include <chrono>
#include <cstdio>
#include <memory>
#include <new>
#include <utility>

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

void Checkpoints::require_known() const {
  if (const Version now = version(); !force_ && now && now != known_)
    throw Error(Error::Kind::output, files_of_map(stem_).front(),
                "was written by another since this run began", "move it elsewhere before this run ends");
}

void Checkpoints::save(const Map& map, std::size_t scans, const KeptScans& kept) {
  finish();
  require_known();
  RunContext().warn(save_map(map, stem_, kept));
  known_ = version();
  scans_ = scans;
}

void Checkpoints::try_to_save(const Map& map, std::size_t scans, const KeptScans& kept) try {
  finish();
  require_known();
  const auto save = std::make_shared<io::MapSave>(map, stem_, kept, false);
  saving_scans_ = scans;
  saving_ = std::async(std::launch::async, [save] { (*save)(); });
} catch (const std::exception& error) {
  fail(scans, error);
}

bool Checkpoints::is_saving() const {
  return saving_.valid() && saving_.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
}

void Checkpoints::finish() try {
  if (!saving_.valid()) return;
  saving_.wait();
  known_ = version();  // taking back what could not be written makes a new one, too
  saving_.get();
  scans_ = saving_scans_;
  failing_ = false;
} catch (const std::exception& error) {
  fail(saving_scans_, error);
}

// No space, no memory or no thread: the next one may succeed.
void Checkpoints::fail(std::size_t scans, const std::exception& error) {
  if (std::exchange(failing_, true)) return;
  std::fprintf(stderr, "warning: no checkpoint of %zu scans, %s; %s, the run goes on\n", scans,
               reason_of(error), last().c_str());
}

std::string Checkpoints::last() const {
  if (!scans_) return "no checkpoint of this run was complete";
  return "the last complete checkpoint is " + stem_ + " with " + std::to_string(*scans_) +
         " scans of this run";
}

const char* reason_of(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ? "out of memory" : error.what();
}

}  // namespace octosurf
