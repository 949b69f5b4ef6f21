#pragma once

#include "surfaces/map_state.hpp"

#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include <octosurf/departures.hpp>

namespace octosurf::map_file {
class Departure;
}  // namespace octosurf::map_file

namespace octosurf::io {

void write_departure(const Departure& departure, map_file::Departure& record);

/// Reads the departures of a map file, record by record, after its surfaces and cylinders.
class DepartureReader {
 public:
  /// Both must outlive it.
  DepartureReader(const surfaces::MapState& state, const std::string& where) : state_(state), where_(where) {}

  /// Throws Error(data) unless the record is valid: an id that was assigned, removed once and not present any
  /// more, in order.
  Departure operator()(const map_file::Departure& record);

 private:
  void require(bool holds, const map_file::Departure& record, const char* what) const;

  const surfaces::MapState& state_;
  const std::string& where_;
  std::set<std::pair<bool, std::uint32_t>> read_;
  std::uint64_t last_revision_ = 0;
};

}  // namespace octosurf::io
