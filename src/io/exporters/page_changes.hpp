#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/page.hpp>
#include <octosurf/scan.hpp>

// Updates for a page that follows a map; web/src/follow.js reads them. A PageBlock, compressed, not as text.

namespace octosurf::io {

/// The pose of the mapping sensor and its track: few enough places to send all in each message.
struct SensorTrack {
  static constexpr std::size_t most_places = 2048;

  std::optional<SensorKind> sensor{};  ///< empty: no scan so far
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector3d> places{};  ///< map frame, oldest first, at least `step_m` from one to the next
  double step_m = 0.01;                   ///< doubled when there are too many places

  void add(SensorKind kind, const Eigen::Isometry3d& pose);
};

/// Complete new or changed surfaces and cylinders, and the ids of removed ones: from `map.changes`, if it is
/// changes_since() a revision, else everything, which replaces all earlier data. `run`: identifies the run of
/// these revisions. The track and the stairs are always complete.
std::string page_changes_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run,
                                 const SensorTrack& track);

/// All voxels, with `slices` also the slices of free space: merged until they take at most `most_bytes`, as
/// in a page.
std::string page_voxels_message(const PageMap& map, const Eigen::Vector3d& up, bool slices,
                                std::size_t most_bytes);

}  // namespace octosurf::io
