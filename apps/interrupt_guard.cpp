#include "interrupt_guard.hpp"

#include "geometry/interruption.hpp"

#include <atomic>
#include <cstdint>
#include <ctime>

namespace octosurf {
namespace {

std::atomic<std::int64_t> interrupted_s{0};
// A signal handler must not wait for a lock.
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<std::int64_t>::is_always_lock_free);

/// The first signal requests an early end. One that follows at once is a duplicate: timeout(1) signals its
/// child and then the child's group. A later one ends the program.
void interrupt(int signal) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (!geometry::interruption.exchange(true)) {
    interrupted_s = now.tv_sec;
  } else if (now.tv_sec - interrupted_s >= 2) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

}  // namespace

bool interrupted() { return geometry::interruption; }

InterruptGuard::InterruptGuard() {
  struct sigaction action {};
  action.sa_handler = interrupt;
  for (std::size_t i = 0; i < signals.size(); ++i) {
    if (signals[i] == SIGPIPE) action.sa_handler = SIG_IGN;
    sigaction(signals[i], &action, &before_[i]);
    // With nohup the run must outlive the terminal.
    if (signals[i] == SIGHUP && before_[i].sa_handler == SIG_IGN) sigaction(SIGHUP, &before_[i], nullptr);
  }
}

InterruptGuard::~InterruptGuard() {
  for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &before_[i], nullptr);
}

}  // namespace octosurf
