#include "memory_limit.hpp"

#include "geometry/page_file.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

struct Resident {
  std::size_t all = 0, of_files = 0;  // bytes
};

/// Nothing where the system does not say.
Resident resident() {
  unsigned long size = 0, all = 0, of_files = 0;
  std::FILE* const file = std::fopen("/proc/self/statm", "re");
  if (file == nullptr) return {};
  const int read = std::fscanf(file, "%lu %lu %lu", &size, &all, &of_files);
  std::fclose(file);
  if (read != 3) return {};
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return {all * page, of_files * page};
}

}  // namespace

std::size_t bytes_of(const std::string& text, const std::string& option) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  std::string unit(end);
  if (unit.size() == 2 && (unit[1] == 'B' || unit[1] == 'b')) unit.pop_back();
  static const std::string units = "kmgt";
  const std::size_t power = unit.empty() ? 0 : units.find(static_cast<char>(unit[0] | 0x20));
  const double bytes = power == std::string::npos || unit.size() > 1 || end == text.c_str()
                           ? 0
                           : std::ldexp(number, unit.empty() ? 0 : 10 * (static_cast<int>(power) + 1));
  if (!(bytes >= 1 && bytes < 0x1p60))
    throw Error(Error::Kind::usage, option, text + " is not a number of bytes", "as in 256M or 1.5G");
  return static_cast<std::size_t>(bytes);
}

MemoryLimit::MemoryLimit(std::size_t bytes, const std::filesystem::path& folder) : limit_(bytes) {
  if (limit_ == 0) return;
  geometry::PageFile::open(folder);
  watcher_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

void MemoryLimit::watch(const std::stop_token& stop) {
  // Within 2 ms two threads fault in some 2 GB/s · 2 ms = 4 MB; a sixteenth of 64 MB and more is as much.
  constexpr std::chrono::milliseconds interval(2);
  const std::size_t near = limit_ - limit_ / 16;
  const std::size_t programs = resident().of_files;  // stays
  for (; !stop.stop_requested(); std::this_thread::sleep_for(interval)) {
    const Resident now = resident();
    if (now.all <= near) continue;
    // Dropping less than an eighth at a time would cost more in faults than it gains. What was new last is
    // where the robot is.
    if (now.of_files >= programs + limit_ / 8) {
      geometry::PageFile::drop(limit_ / 4);
      if (resident().all > near - limit_ / 8) geometry::PageFile::drop();
    } else if (now.all > limit_) {
      most_ = std::max(most_.load(), now.all);
    }
  }
}

void MemoryLimit::warn_if_exceeded() const {
  if (limit_ == 0) return;
  // Short runs may end before the watcher has looked.
  geometry::PageFile::drop();
  const std::size_t now = resident().all, most = std::max(most_.load(), now > limit_ ? now : 0);
  if (most == 0) return;
  const auto mb = [](std::size_t bytes) { return (bytes + (std::size_t{1} << 20) - 1) >> 20; };
  std::fprintf(stderr,
               "warning: --max-memory %zuM was too little for the surfaces and what a scan needs at once: "
               "the run took %zuM, the least that works for certain\n",
               mb(limit_), mb(most));
}

}  // namespace octosurf
