#include "progress.hpp"

#include "io/text_file.hpp"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace octosurf {

Progress::Progress(std::size_t total)
    : total_(std::max<std::size_t>(total, 1)), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (open_) std::fputc('\n', stderr);
}

std::string Progress::pace(std::size_t done) const {
  const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (done == 0 || !(spent > 0)) return {};
  const double rate = static_cast<double>(done) / spent;
  const std::string text = io::formatted(", %.*f a second", rate < 10 ? 1 : 0, rate);
  if (done == total_) return text;
  const auto left = static_cast<long>(static_cast<double>(total_ - done) / rate + 0.5);
  return text + io::formatted(", %ld:%02ld left", left / 60, left % 60);
}

void Progress::show(std::size_t done, const std::function<std::string()>& note) {
  constexpr std::chrono::milliseconds least_between(200);
  done = std::min(done, total_);
  const auto now = std::chrono::steady_clock::now();
  if (terminal_ ? done < total_ && now - shown_ < least_between : 10 * done / total_ <= tenths_) return;
  shown_ = now;
  tenths_ = 10 * done / total_;
  const std::string text = std::to_string(done) + "/" + std::to_string(total_) + " scans" + pace(done) +
                           (note ? ", " + note() : "");
  if (!terminal_) {
    std::fprintf(stderr, "%s\n", text.c_str());
    return;
  }
  constexpr std::size_t width = 40;
  const std::string bar(width * done / total_, '#');
  std::fprintf(stderr, "\r[%-*s] %s\033[K", static_cast<int>(width), bar.c_str(), text.c_str());
  open_ = done < total_;
  if (!open_) std::fputc('\n', stderr);
}

}  // namespace octosurf
