#include "history_log.hpp"

#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {

HistoryLog::HistoryLog(std::string file, Before before, const Snapshot& start)
    : file_(std::move(file)), force_(before.force) {
  std::error_code ignored;
  if (file_.empty() || !before.resumed || !std::filesystem::exists(file_, ignored)) return;
  try {
    History found = load_history(file_);
    if (!found.belongs_to(start))
      throw Error(Error::Kind::usage, "--history " + file_, "is the history of another map",
                  "give another name, or --force to write over it");
    found.forget_after(start.revision);
    history_ = std::move(found);
    force_ = true;
  } catch (const Error&) {
    if (!before.force) throw;  // else it is written over, whatever it was
  }
}

void HistoryLog::add(const Snapshot& snapshot, double stamp_s) {
  if (!file_.empty()) history_.add(snapshot, stamp_s);
}

void HistoryLog::save() {
  if (file_.empty()) return;
  save_history(history_, file_, force_);
  force_ = true;  // from now on it is ours
  failing_ = false;
}

void HistoryLog::try_to_save() try { save(); } catch (const Error& error) {
  if (failing_) return;
  failing_ = true;
  std::fprintf(stderr, "warning: %s; the run goes on\n", error.what());
}

}  // namespace octosurf
