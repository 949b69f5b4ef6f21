#include "arrivals.hpp"

#include "interrupt_guard.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>
#include <utility>

namespace octosurf {

void Arrivals::wait_and_join(std::vector<PreparedScan>& scans, ScanFeed& feed,
                             std::optional<double> last_stamp_s) {
  const Scan& first = scans.front().scan();
  constexpr double longest_pause_s = 60;  // by then all is found and saved; a clock that is set takes years
  const double pause_s = last_stamp_s ? first.stamp_s - *last_stamp_s : 0;
  if (pause_s > longest_pause_s)
    std::fprintf(stderr, "warning: %.0f s until %s are not waited for\n", pause_s, first.name.c_str());
  if (!last_stamp_s || pause_s > longest_pause_s) zero_s_ = now_s_() - first.stamp_s;
  constexpr double longest_s = 0.05;  // to notice interrupts
  for (double left_s; (left_s = of(first) - now_s_()) > 0 && !interrupted();)
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left_s, longest_s)));
  // A burst passes by itself; joining delays what was in the first of them.
  constexpr double long_wait_s = 0.5;  // most_joined scans of a camera
  if (now_s_() - of(first) < long_wait_s) return;
  for (const Scan* next;
       scans.size() < most_joined && (next = feed.peek()) != nullptr && of(*next) <= now_s_();)
    scans.emplace_back(std::move(*feed.next()));
}

}  // namespace octosurf
