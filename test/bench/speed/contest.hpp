#pragma once

#include "bench/speed/contestant.hpp"

#include <memory>
#include <string>
#include <vector>

namespace octosurf::bench {

/// What one run() took.
struct Turn {
  double ms = 0;      ///< wall clock
  double cpu_ms = 0;  ///< of all threads of the contestant
  std::vector<double> stage_ms;
};

/// Contestants that do the same work by turns, scan after scan, so that whatever else the machine does
/// hits all of them alike.
///
/// 1. Each is a process of its own, started by exec: its heap holds nothing but its own, never
///    another's leftovers, and can be measured by malloc's own count.
/// 2. Only Contestant::run() is timed, by the contestant itself. Scans reach it through shared memory
///    and are put into its own form before the clock starts.
/// 3. Who begins changes from turn to turn.
class Contest {
 public:
  Contest();
  ~Contest();
  Contest(const Contest&) = delete;
  Contest& operator=(const Contest&) = delete;

  /// `name`: unique in this contest. Throws what the contestant's constructor throws, as Error(data).
  void enter(const std::string& name, const std::string& kind, const Json& settings);

  /// Everyone takes the scan and runs, one after the other.
  void turn(const Scan& scan);
  /// Everyone runs, without a scan.
  void turn();

  // The same for one alone.
  void prepare(const std::string& name, const Scan& scan);
  Turn run(const std::string& name);
  Json ask(const std::string& name, const Json& question);

  /// Its turns so far.
  const std::vector<Turn>& turns(const std::string& name) const;

 private:
  class Board;
  struct Entry;
  Entry& entry(const std::string& name) const;
  void play(bool with_scan);

  std::unique_ptr<Board> board_;
  std::vector<std::unique_ptr<Entry>> entries_;
  std::size_t rounds_ = 0;
};

/// The contestant's side: true if the arguments are those of a contestant's process, which then has
/// been served to its end.
bool serve_contestant(int argc, char** argv);

}  // namespace octosurf::bench
