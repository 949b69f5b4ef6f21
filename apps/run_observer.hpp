#pragma once

#include <octosurf/mapper.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

/// A scan that has just been inserted. Times in s on the run's clock.
struct InsertedScan {
  const Scan& scan;
  const ScanReport& report;
  double arrival_s, done_s;
};

/// When a run saves its outputs.
enum class Saving {
  checkpoint,  ///< a failure is a warning, as the next may succeed
  end          ///< of the run, also where it failed
};

/// Takes part in a run of `octosurf map`, in the thread that maps. What it throws ends the run, which then
/// saves what is mapped.
class RunObserver {
 public:
  virtual ~RunObserver() = default;

  virtual void after(const InsertedScan&) {}  ///< unless its pose was rejected
  /// Scans or a drained queue have changed the map. `stamp_s`: of the last scan.
  virtual void changed(double /*stamp_s*/) {}
  virtual void save(Saving) {}
};

}  // namespace octosurf
