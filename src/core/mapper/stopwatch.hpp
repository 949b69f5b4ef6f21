#pragma once

#include "geometry/interruption.hpp"

#include <chrono>
#include <cstddef>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// Runs one stage, unless work is to end, and records its time.
class Stopwatch {
  using Clock = std::chrono::steady_clock;

 public:
  explicit Stopwatch(ScanReport& report) : report_(report) {}
  template <class Work>
  decltype(auto) operator()(Stage stage, Work&& work) {
    geometry::end_if_interrupted();
    struct Note {
      ScanReport& report;
      std::size_t stage;
      Clock::time_point start = Clock::now();
      ~Note() {
        const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        report.stage_ms[stage] += ms;
        report.total_ms += ms;
      }
    } note{report_, static_cast<std::size_t>(stage)};
    return work();
  }

 private:
  ScanReport& report_;
};

/// Of the same scan.
inline void add_times(const ScanReport& times, ScanReport& report) {
  for (std::size_t stage = 0; stage < times.stage_ms.size(); ++stage)
    report.stage_ms[stage] += times.stage_ms[stage];
  report.total_ms += times.total_ms;
}

}  // namespace octosurf::mapper
