#pragma once

#include <cstddef>
#include <string>

namespace octosurf {

/// How far the work is, on stderr: a bar that is drawn over on a terminal, a line for every tenth of
/// the way elsewhere.
class Progress {
 public:
  explicit Progress(std::size_t total);
  ~Progress();  ///< leaves a bar that was not finished on a line of its own
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` scans of the total; `note` is put behind them, e.g. "12 surfaces".
  void show(std::size_t done, const std::string& note = {});

 private:
  std::size_t total_;
  std::size_t tenths_ = 0;  ///< already told
  bool terminal_;
  bool open_ = false;  ///< the cursor stands behind a bar
};

}  // namespace octosurf
