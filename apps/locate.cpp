#include "locate.hpp"

#include "geometry/degrees.hpp"
#include "io/text_file.hpp"
#include "judgement/spread.hpp"

#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
namespace {

std::string text_of(const Eigen::Isometry3d& T) {
  const Eigen::Vector3d ahead = T.linear().col(0);
  return io::formatted("%.2f %.2f %.2f, turned %.0f°", T.translation().x(), T.translation().y(),
                       T.translation().z(), deg_per_rad * std::atan2(ahead.y(), ahead.x()));
}

[[noreturn]] void refuse(const std::string& map, const std::string& name, const Whereabouts& where) {
  const std::string turn = "poses in the map's frame need no search (localize --guess, map without --locate)";
  if (where.finding == Finding::not_here)
    throw Error(Error::Kind::data, name, "was not taken anywhere in " + map, turn);
  if (where.finding == Finding::undecided)
    throw Error(Error::Kind::data, name, "fits no place in " + map + " well enough to be sure",
                "turn the sensor by 180° or drive on; " + turn);
  std::string places;
  for (const Alignment& place : where.places)
    places += (places.empty() ? "" : " and ") + text_of(place.T_map_sensor);
  throw Error(Error::Kind::data, name,
              "fits several places in " + map + " alike, with the sensor at " + places,
              "drive on to where they differ; " + turn);
}

}  // namespace

Eigen::Isometry3d locate(const Map& map, const std::string& name, ScanFeed recording, bool upright,
                         bool says) {
  constexpr std::size_t most_scans = 600;  // 20 s of a camera's, 60 of a lidar's
  judgement::Spread<Scan> run(16);         // as many as are looked at
  Localizer localizer(map);
  Whereabouts where;
  std::string last;
  for (std::size_t scans = 1, tried = 0; scans <= most_scans; ++scans) {
    std::optional<Scan> scan = recording.next();
    if (scan) {
      last = scan->name;
      if (run.wants()) run.take(*std::move(scan));
    }
    // With each half as many scans more; in the end with all.
    if (const bool end = recording.peek() == nullptr; !end && 2 * scans < 3 * tried) continue;
    tried = scans;
    if (run.kept().empty()) break;
    where = localizer.find(run.kept(), {}, upright);
    if (where.finding == Finding::found) {
      if (says)
        std::printf("%-12s by %s, at %s\n", "located", io::count_of(scans, "scan").c_str(),
                    text_of(where.places.front().T_map_sensor).c_str());
      return where.T_map_scans;
    }
    if (recording.peek() == nullptr) break;
  }
  refuse(name, last, where);
}

}  // namespace octosurf
