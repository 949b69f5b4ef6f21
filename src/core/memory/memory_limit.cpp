#include "memory/memory_limit.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <sys/resource.h>
#include <unistd.h>

namespace octosurf::memory {
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

std::size_t peak_of_process() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) << 10;
}

MemoryLimit::MemoryLimit(std::size_t bytes, const std::filesystem::path& folder)
    : limit_(bytes), pages_(std::make_shared<PageFile>(folder)), peak_before_(peak_of_process()) {
  watcher_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

void MemoryLimit::watch(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds interval(2);
  const std::size_t near = limit_ - limit_ / 16;   // of 64 MB and more it leaves what is unseen
  const std::size_t others = resident().of_files;  // the program's, and other maps'
  for (; !stop.stop_requested(); std::this_thread::sleep_for(interval)) {
    const Resident now = resident();
    seen_ = std::max(seen_.load(), now.all);
    const std::size_t own_files = now.of_files - std::min(others, now.of_files);
    kept_ = std::max(kept_.load(), now.all - own_files);
    // Dropping less than an eighth at a time would cost more in faults than it gains. What was new last is
    // where the robot is.
    if (now.all <= near || std::min(pages_->used(), own_files) < limit_ / 8) continue;
    pages_->drop(limit_ / 4);
    if (resident().all > near - limit_ / 8) pages_->drop();
  }
}

std::size_t MemoryLimit::peak() const {
  // The system's own figure is exact, but of the whole process's life.
  const std::size_t all = peak_of_process();
  return all > peak_before_ ? all : std::max(seen_.load(), resident().all);
}

}  // namespace octosurf::memory
