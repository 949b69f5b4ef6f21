#pragma once

#include <string>

#include <octosurf/history.hpp>

namespace octosurf {

/// How the map of a run came about, as a file (`--history`).
class HistoryLog {
 public:
  /// What may become of a file that is there.
  struct Before {
    bool force = false;    ///< written over
    bool resumed = false;  ///< gone on with, if it is of the map that the run goes on with
  };

  /// No file is written if `file` is empty. `start`: of the map that the run starts from. Throws Error(usage)
  /// for a file of another map, Error(data) for a damaged one.
  HistoryLog(std::string file, Before before, const Snapshot& start);

  void add(const Snapshot& snapshot, double stamp_s);
  /// Writes all there is; throws Error(output), Error(usage).
  void save();
  /// As save(), but what fails is told once on stderr, and may succeed the next time.
  void try_to_save();

 private:
  std::string file_;
  bool force_, failing_ = false;
  History history_;
};

}  // namespace octosurf
