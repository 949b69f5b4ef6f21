#pragma once

#include <cstdint>
#include <map>
#include <set>

namespace octosurf::surfaces {

/// Matches surfaces before a change of the map with those after it, by the readings that they share.
class SharedReadings {
 public:
  using Id = std::uint64_t;
  struct Shares {
    double all = 0;             ///< readings, also those that nothing shares
    std::map<Id, double> with;  ///< of them, shared with each

    /// The one that shares most, on a tie the lower id; 0: none.
    Id most() const;
    double shared(Id id) const;
  };

  /// 0: readings of no surface.
  void add(Id before, Id after, double readings = 1);
  const std::map<Id, Shares>& before() const { return before_; }
  /// Readings of a surface after the change.
  double after(Id id) const;
  /// By surface after the change, the one before it whose id it keeps: of those with most of their readings
  /// in it the one with most there, on a tie the lower id; `unpublished` ones come last.
  std::map<Id, Id> keepers(const std::set<Id>& unpublished = {}) const;
  /// By surface after the change, the one before it that had more than half of its readings, if any.
  std::map<Id, Id> origins() const;

 private:
  std::map<Id, Shares> before_;
  std::map<Id, double> after_;
};

}  // namespace octosurf::surfaces
