#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace octosurf {

/// How far the work is, how fast it goes and how long it still takes, on stderr: a bar that is drawn over on
/// a terminal, a line for every tenth of the way elsewhere.
class Progress {
 public:
  explicit Progress(std::size_t total);
  ~Progress();  ///< leaves a bar that was not finished on a line of its own
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` scans of the total; `note` is put behind them, e.g. "12 surfaces".
  void show(std::size_t done, const std::string& note = {});

 private:
  /// ", 12 a second, 1:05 left"; empty until something is done.
  std::string pace(std::size_t done) const;

  std::size_t total_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::size_t tenths_ = 0;  ///< already printed
  bool terminal_;
  bool open_ = false;  ///< the cursor stands behind a bar
};

}  // namespace octosurf
