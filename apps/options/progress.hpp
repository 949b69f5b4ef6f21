#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>

namespace octosurf {

/// Progress, pace and remaining time on stderr: a bar on a terminal, at most five times a second, elsewhere a
/// line for every tenth.
class Progress {
 public:
  explicit Progress(std::size_t total);
  ~Progress();  ///< ends the line of an unfinished bar
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` scans of the total; followed by note(), e.g. "12 surfaces", which is called if it is shown.
  void show(std::size_t done, const std::function<std::string()>& note = {});

 private:
  /// ", 12 a second, 1:05 left"; empty until something is done.
  std::string pace(std::size_t done) const;

  std::size_t total_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), shown_;
  std::size_t tenths_ = 0;  ///< already printed
  bool terminal_;
  bool open_ = false;  ///< the cursor is behind a bar
};

}  // namespace octosurf
