#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

/// Do the scans of a recording agree with one another, at the poses at which they were mapped?
///
/// Up to 36 views, spread over the recording, are compared in pairs: 200 places of each in the other's range
/// image. A place agrees within half a voxel and three deviations of the sensor's own noise; else it is off,
/// or was seen through. A pair contradicts if most places do, and not only because somebody walked past, or
/// if one motion would bring together most of what faces along it: an error along one axis moves nothing
/// else.
struct Judgement {
  std::size_t views = 0;          ///< compared
  std::size_t alone = 0;          ///< of them, those that see nothing which another one sees: not judged
  std::size_t sparse = 0;         ///< of them, those with too few readings to know surfaces: not judged
  std::size_t pairs = 0;          ///< of views that see at least 30 places in common
  std::size_t contradicting = 0;  ///< of these
  /// The direction, of the three that surfaces face most, along which most pairs contradict of those that see
  /// ten surfaces or more facing it; map axes, of length 1.
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  std::size_t axis_pairs = 0;          ///< that do
  std::size_t axis_contradicting = 0;  ///< of these, along it
  std::vector<std::string> outvoted;   ///< scans that contradict most of their partners
  std::size_t judged = 0;              ///< views with at least three partners, of which `outvoted` are some

  std::array<std::string, 2> worst;  ///< the two scans that contradict each other most
  std::size_t worst_places = 0;      ///< that they have in common
  std::size_t worst_apart = 0;       ///< of these, do not agree

  /// How much of what places are off one constant error of all scans explains (mount, scale, focal length,
  /// delay), measured on scans that it was not fitted to: a share.
  double common_error = 0;
  double common_error_m = 0;  ///< by which it moves places, root mean square

  /// What stands out by itself, and whose views contradict others half as often again as all do: a step of
  /// the poses, readings or poses as of the scan before, the identity as a pose.
  std::vector<std::string> oddities;

  double step_m = 0;        ///< median, between consecutive scans
  double range_m = 0;       ///< median of readings
  double resolution_m = 0;  ///< of the map

  bool many_pairs() const;        ///< contradict: a tenth, and two, of all or of those that measure the axis
  bool many_outvoted() const;     ///< a twentieth of the judged views, and two
  bool has_common_error() const;  ///< it explains a quarter, and moves places by a fifth of a voxel
  /// Most views stand alone, and scans lie farther apart than they see: no sensor moves so.
  bool too_far_apart() const;
  /// Any of these: the map that the scans make is doubtful, whatever the cause.
  bool contradicts() const;
  /// One line: what contradicts, and where most; empty if nothing does.
  std::string describe() const;
};

/// Judges a recording, scan by scan as they are mapped. Keeps some 120 kB of at most 96 views.
///
///   judge.add(scan, mapper.insert(scan).alignment.T_map_sensor);
class RecordingJudge {
 public:
  /// Of the map: resolution and ranges.
  explicit RecordingJudge(const Parameters& parameters = {});
  RecordingJudge(RecordingJudge&&) noexcept;
  RecordingJudge& operator=(RecordingJudge&&) noexcept;
  ~RecordingJudge();

  /// `T_map_sensor`: where the scan was mapped. A millisecond for a scan whose view is kept.
  void add(const Scan& scan, const Eigen::Isometry3d& T_map_sensor);
  /// Of the scans so far: some 0.1 s.
  Judgement judge() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
