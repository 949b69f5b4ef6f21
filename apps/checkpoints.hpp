#pragma once

#include <cstddef>
#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// Saves checkpoints of a run. A failed one is reported once on stderr, and the run continues with the
/// previous one.
class Checkpoints {
 public:
  /// Every `period_s` seconds; 0: never.
  Checkpoints(std::string stem, double period_s) : stem_(std::move(stem)), period_s_(period_s) {}

  /// The period runs from here.
  void start(double now_s) { tried_s_ = now_s; }
  bool due(double now_s) const { return period_s_ > 0 && now_s - tried_s_ >= period_s_; }
  /// Saves, or warns.
  void try_to_save(const Map& map, std::size_t scans, const KeptScans& kept);
  /// Saves, or throws what save_map() throws. `scans`: of this run, in the map.
  void save(const Map& map, std::size_t scans, const KeptScans& kept);

  bool any() const { return any_; }
  std::size_t scans() const { return scans_; }  ///< in the last complete one
  const std::string& stem() const { return stem_; }

 private:
  std::string stem_;
  double period_s_;
  double tried_s_ = 0;
  std::size_t scans_ = 0;
  bool any_ = false, failing_ = false;
};

}  // namespace octosurf
