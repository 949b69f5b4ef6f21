#include "progress.hpp"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace octosurf {

Progress::Progress(std::size_t total)
    : total_(std::max<std::size_t>(total, 1)), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (open_) std::fputc('\n', stderr);
}

void Progress::show(std::size_t done, const std::string& note) {
  done = std::min(done, total_);
  const std::string text =
      std::to_string(done) + "/" + std::to_string(total_) + " scans" + (note.empty() ? "" : ", " + note);
  if (terminal_) {
    constexpr std::size_t width = 40;
    const std::string bar(width * done / total_, '#');
    std::fprintf(stderr, "\r[%-*s] %s\033[K", static_cast<int>(width), bar.c_str(), text.c_str());
    open_ = done < total_;
    if (!open_) std::fputc('\n', stderr);
  } else if (10 * done / total_ > tenths_) {
    tenths_ = 10 * done / total_;
    std::fprintf(stderr, "%s\n", text.c_str());
  }
}

}  // namespace octosurf
