#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/page.hpp>
#include <octosurf/scan.hpp>

// What a page that follows a map is told; web/src/follow.js reads it. A PageBlock, compressed, not as text.

namespace octosurf::io {

/// Where the sensor is whose scans make the map, and where it has been: few enough places for each message to
/// have them all.
struct SensorTrack {
  static constexpr std::size_t most_places = 2048;

  std::optional<SensorKind> sensor{};  ///< nothing: there has been no scan
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector3d> places{};  ///< map frame, oldest first, at least `step_m` from one to the next
  double step_m = 0.01;                   ///< twice as much whenever places become too many

  void add(SensorKind kind, const Eigen::Isometry3d& pose);
};

/// Surfaces and cylinders that appeared or changed, whole, and the ids of those that are gone: by
/// `map.changes`, if it is changes_since() a revision, else everything, in the place of whatever was known.
/// `run`: whose revisions these are. The track is always whole.
std::string page_changes_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run,
                                 const SensorTrack& track);

/// All voxels, with `slices` the slices of free space, too: merged until they take no more than `most_bytes`,
/// as a page's are.
std::string page_voxels_message(const PageMap& map, const Eigen::Vector3d& up, bool slices,
                                std::size_t most_bytes);

}  // namespace octosurf::io
