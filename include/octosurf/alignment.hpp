#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

class Map;

/// A small motion: three rotations (rad), then three translations (m), map axes, about the sensor's position.
using Twist = Eigen::Matrix<double, 6, 1>;
/// Of a Twist: rad², rad·m and m².
using TwistCovariance = Eigen::Matrix<double, 6, 6>;

/// Result of a scan's alignment.
enum class AlignmentOutcome {
  off,            ///< alignment is disabled: the given pose
  nothing_known,  ///< too few points lie near the map's surfaces: the given pose
  agrees,         ///< no significant drift: the given pose, bit by bit
  corrected,      ///< moved onto the surfaces that the scan sees again
  recovered,      ///< far off, as the previous scan was; relocated by matching planes
  /// Not inserted: far off, and no other scan confirms it; or it fits nowhere and most of it contradicts the
  /// octree.
  rejected,
  unexplained  ///< fits nowhere within reach: the given pose with the previous corrections
};
/// By AlignmentOutcome, as in reports.
inline constexpr std::array<std::string_view, 7> alignment_outcome_names{
    "off", "nothing_known", "agrees", "corrected", "recovered", "rejected", "unexplained"};

/// A scan's pose against the surfaces of a map.
struct Alignment {
  AlignmentOutcome outcome = AlignmentOutcome::off;                ///< result
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();  ///< estimated pose
  /// Of the pose's error as a twist, estimated from scan and map. A direction that they do not determine has
  /// the variance of the search reach and stays as given.
  TwistCovariance covariance = TwistCovariance::Zero();
  /// Orthonormal columns, best determined first; the first `determined` are fixed by surfaces to within half
  /// a voxel. Rotations are scaled by `lever_m`. For a mapped scan, only surfaces seen at least a metre of
  /// travel earlier count: none if nothing older is revisited, or little besides recently seen surfaces.
  TwistCovariance directions = TwistCovariance::Identity();
  int determined = 0;         ///< 0 … 6
  double lever_m = 1;         ///< distance at which rotations move the scan's points, m
  std::size_t samples = 0;    ///< points of the scan that were evaluated
  std::size_t known = 0;      ///< samples near surfaces of the map
  std::size_t explained = 0;  ///< known samples on the surface at this pose, within the noise
  /// Of the readings, those that stand in the map's free space or behind surfaces that they would have met,
  /// at a pose to which a scan was moved.
  double contradicted = 0;

  /// Of the known samples, [0, 1]; 0 if there are none.
  double explained_share() const {
    return known > 0 ? static_cast<double>(explained) / static_cast<double>(known) : 0;
  }
};

/// Search range of align() about the given pose.
struct AlignmentReach {
  double translation_m = 0.3;                     ///< in any direction
  double rotation_rad = 0.08726646259971647;      ///< 5°; beyond 20° about `up` only
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< unit, map frame
};

/// Whether a run of scans has a place in a map.
enum class Finding {
  found,           ///< one place fits, and no other one nearly as well
  several_places,  ///< more than one does
  not_here,        ///< none does
  undecided        ///< too little was seen, or it fits too poorly, to tell
};
/// By Finding.
inline constexpr std::array<std::string_view, 4> finding_names{"found", "several places", "not here",
                                                               "undecided"};

/// Where in a map a run of scans was taken.
struct Whereabouts {
  Finding finding = Finding::undecided;  ///< what is known of it
  /// The frame of the scans' poses to the map's, if found.
  Eigen::Isometry3d T_map_scans = Eigen::Isometry3d::Identity();
  /// Poses of the last scan's sensor that fit, best first; evidence is that of all scans.
  std::vector<Alignment> places;
  /// By how much more of the readings the first place explains, less what contradicts, than any other.
  double margin = 0;
  double seen_rad = 0;  ///< directions about `up` in which the first place explains what is seen
};

/// Localises scans against the surfaces of a finished map, without odometry between scans.
/// `scan.T_map_sensor` is a first guess, at most `reach` off. The pose moves only along directions that the
/// visible surfaces determine; outcome `unexplained` means that the scan fits nowhere, or several places
/// equally well, or that the map contradicts it where it fits: more than changes of a place do (a tenth of
/// the readings), or more than at a right pose (0.5 %) while somewhere else, within 10 m, it contradicts
/// less.
///
/// Fine registration is point-to-plane (Chen and Medioni 1992) with robust weights, after plane matching.
/// Deterministic. 5 to 30 ms a scan, 100 where many surfaces are alike, 0.5 s where something contradicts or
/// turns of more than 20° are searched. Throws Error(data) if the pose is not rigid.
class Localizer {
 public:
  /// In the map as it is now; turns about its up direction, if it states one.
  explicit Localizer(const Map& map, const AlignmentReach& reach = {});
  /// In a snapshot. What contradicts is seen only in one with an octree (Mapper::share_octree()).
  explicit Localizer(std::shared_ptr<const Snapshot> map, const AlignmentReach& reach = {});
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;
  ~Localizer();
  /// Estimates the pose of `scan`; one thread at a time.
  Alignment operator()(const Scan& scan);
  /// Finds the place of a run of scans without a guess: their poses are right against each other, to some
  /// per cent of the way, and about `up`, to a few degrees; unless `upright`, one of their planes is level.
  /// A place is searched for its last sensor in `region` (map frame; empty: anywhere).
  ///
  /// 1. Found is one place that explains nine tenths of what it knows, that hardly a reading contradicts, and
  ///    that fits better than all others by a sixteenth of the readings. Changes and clutter are undecided.
  /// 2. More places that fit are several_places, with the poses: rooms alike, a corridor's length.
  /// 3. What explains only half of the directions around is undecided: a corner fits every room.
  ///    A camera turns by 180°, a lidar need not move.
  ///
  /// Branch and bound over translations and turns of the octree's maxima (src/core/alignment/place_search.hpp
  /// says what of that is not exact). 0.1 to 2 s, the first time also 20 ns for each voxel. Needs an octree.
  /// Throws Error(usage) without scans, Error(data) if a pose is not rigid.
  Whereabouts find(std::span<const Scan> scans, const Eigen::AlignedBox3d& region = {}, bool upright = true);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
