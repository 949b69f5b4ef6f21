#pragma once

#include <array>
#include <csignal>

namespace octosurf {

/// Whether an early end was requested by a signal.
bool interrupted();

/// While it lives, the first Ctrl-C, SIGTERM or hang-up makes interrupted() true, and ends the scan that is
/// being inserted; one at least two seconds later ends the program. A closed output pipe is ignored.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  static constexpr std::array<int, 4> signals{SIGINT, SIGTERM, SIGHUP, SIGPIPE};
  std::array<struct sigaction, signals.size()> before_{};
};

}  // namespace octosurf
