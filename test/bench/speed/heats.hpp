#pragma once

#include "bench/speed/scans.hpp"

#include <memory>

namespace octosurf::bench {

/// One pass over a set of scans by all contestants that some row asked for; the rows share it, so that
/// no contestant does the same work twice. Runs when the first row needs a result.
class Heat {
 public:
  /// `key`: rows that give the same one share the heat.
  static Heat& of(const std::string& key, const ScanSet& scans);

  /// Before the first result; a name that has entered already is the same contestant.
  void enter(const std::string& name, const std::string& kind, const Json& settings);

  const std::vector<Turn>& turns(const std::string& name);
  /// What it told at the end. Octomap's tree is handed to every `occupancy` and `plain` for comparison, and
  /// every `mapper` saves its map; where to stands in "stem".
  const Json& told(const std::string& name);

 private:
  explicit Heat(ScanSet scans) : scans_(std::move(scans)) {}
  struct Entrant {
    std::string kind;
    Json settings;
    std::vector<Turn> turns;
    Json told;
  };
  Entrant& result(const std::string& name);
  void run();

  ScanSet scans_;
  std::map<std::string, Entrant> entrants_;
  bool done_ = false;
};

}  // namespace octosurf::bench
