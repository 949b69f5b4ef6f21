#pragma once

#include "alignment/contradiction.hpp"
#include "alignment/place_search.hpp"
#include "alignment/pose_search.hpp"

#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// A run of scans at one of the poses that fit it.
struct PlacedRun {
  Alignment alignment;  ///< of its last sensor
  double sigma_m = 0;   ///< largest deviation of a direction, m; rotations by the lever
  double seen_rad = 0;  ///< as in Whereabouts
  /// Of the readings, explained less contradicted.
  double value() const {
    return static_cast<double>(alignment.explained) / static_cast<double>(alignment.samples) -
           alignment.contradicted;
  }
  /// Of those explained or contradicted.
  double contradicted_share() const {
    return alignment.contradicted / (value() + 2 * alignment.contradicted);
  }
};

/// All of them, best first.
struct RunPlaces {
  std::vector<PlacedRun> placed;
  bool complete = true;        ///< none that is as good is missing
  std::size_t candidates = 0;  ///< of the search, whether or not they could be fitted
};

/// By what the place of a run is accepted. From 140 right and 60 wrong runs in simulated rooms: where nothing
/// has changed 0.1 % of the readings contradict a right place at most, where half of the furniture has moved
/// 8 %. In another room a lidar's contradict by 10 % and more, a camera's that has turned by 180° by 3 %.
struct PlaceAcceptance {
  double contradicted = 0.1;  ///< a place is none from here on
  /// contradicted_share() of a run that has seen all around. The less of the directions beyond half is seen,
  /// the better fit other rooms: down to none, as a corner fits every room. Five times what contradicts 95 %
  /// of the right places: what has changed by more is undecided, for a wrong frame costs more.
  double contradicted_all_around = 0.003;
  double explained = 0.9;  ///< of what is known; at right places 0.92 and more
  double known = 0.2;      ///< share of the readings: less is known by chance
  double margin = 0.06;    ///< besides what contradicts: the second of two equal rooms is 0.055 less good
  double sigma_m = 0.05;   ///< of every direction: else it may slide along a corridor
};

/// Where in a map, whose surfaces and cells are these, a run fits.
RunPlaces places_of(std::span<const Scan> scans, const CheckedMap& map, const CellPyramid& cells,
                    const Eigen::Vector3d& up, const Eigen::AlignedBox3d& region, bool upright,
                    const PlaceLimits& limits = {});

/// What is to be said of them.
Whereabouts judge(const RunPlaces& places, const Eigen::Isometry3d& T_scans_sensor,
                  const PlaceLimits& limits = {}, const PlaceAcceptance& acceptance = {});

}  // namespace octosurf::alignment
