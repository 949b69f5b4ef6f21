#pragma once

#include "io/files.hpp"
#include "map_file.pb.h"

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::test {

class MapFiles : public FolderTest {
 protected:
  /// Writes `content` as map.surfaces and loads it: the message of its Error(data), which says what mends
  /// it; "loaded" if there is none. Any other exception fails the test.
  std::string loading(const std::string& content) const;
};

/// 5 cm voxels; everything else as by default.
Parameters coarse();

/// Scans in a room whose walls change with scan 5: the first ones are seen through, and vanish. The
/// last two scans are of a few single points each, which wait for a detection run.
std::vector<Scan> changing_room(std::size_t scans, std::mt19937_64 rng = test::rng());

/// Depth images of a corner of a room with a pillar of radius 0.3 m, from changing sides; the pillar is taken
/// away before the last `gone` of them.
std::vector<Scan> pillar(std::size_t scans, std::size_t gone = 0, std::mt19937_64 rng = test::rng());

Map map_of(const std::vector<Scan>& scans, const Parameters& parameters = coarse());

/// A new map file.
std::string bytes_of(const Map& map);

/// What differs between two maps, field by field; empty if nothing does.
std::string difference(const Map& a, const Map& b);

/// A map file taken apart and put together again, with sums that are true.
std::vector<map_file::Record> unpack(const std::string& file);
std::string pack(const std::vector<map_file::Record>& records);
/// The surface with the largest id. Whether it is the last record differs from world to world.
map_file::Surface& last_surface(std::vector<map_file::Record>& records);

}  // namespace octosurf::test
