#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <memory>
#include <string_view>

#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// A small motion: three rotations (rad), then three translations (m), map axes, about the sensor's position.
using Twist = Eigen::Matrix<double, 6, 1>;
/// Of a Twist: rad², rad·m and m².
using TwistCovariance = Eigen::Matrix<double, 6, 6>;

/// How a scan's pose came out of its alignment.
enum class AlignmentOutcome {
  off,            ///< not asked for: the pose is the given one
  nothing_known,  ///< too few of its points lie where the map has surfaces: the given pose
  agrees,         ///< nothing speaks for a drift: the given pose, to the bit
  corrected,      ///< moved to where the map has what it sees again
  recovered,      ///< lay far off, as the scan before did, and was found again by matching planes
  set_aside,   ///< lies far off, and so far no other scan does: not inserted
  unexplained  ///< fits nowhere within reach: the pose is the given one, with the corrections before it
};
/// By AlignmentOutcome, as in reports.
inline constexpr std::array<std::string_view, 7> alignment_outcome_names{
    "off", "nothing_known", "agrees", "corrected", "recovered", "set_aside", "unexplained"};

/// A scan's pose against the surfaces of a map.
struct Alignment {
  AlignmentOutcome outcome = AlignmentOutcome::off;                ///< what was done
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();  ///< the pose that came out
  /// Of the pose's error as a twist, as far as scan and map tell. A direction that they do not determine has
  /// the variance of the search's reach: it stays as given.
  TwistCovariance covariance = TwistCovariance::Zero();
  /// Orthonormal columns, the first `determined` of which are the directions that surfaces fix to within half
  /// a voxel, the best first. Rotations count by `lever_m`. Of a scan that is mapped, surfaces that were seen
  /// a metre of way ago or more: none where nothing old is seen again, or hardly anything else than a moment
  /// ago.
  TwistCovariance directions = TwistCovariance::Identity();
  int determined = 0;         ///< 0 … 6
  double lever_m = 1;         ///< distance at which rotations move the scan's points
  std::size_t samples = 0;    ///< of the scan's points that were looked at
  std::size_t known = 0;      ///< of them, near surfaces that the map has
  std::size_t explained = 0;  ///< of those, on the surface at this pose, as far as the noise lets tell
  /// As far as given pose and map disagree, whether that was corrected or not; without what is the sensor's own
  /// error.
  Twist disagreement = Twist::Zero();
  /// How far the scan lies from where those before it let expect it, m, along the determined directions.
  double innovation_m = 0;

  /// Of the known samples, [0, 1]; 0 if there are none.
  double explained_share() const {
    return known > 0 ? static_cast<double>(explained) / static_cast<double>(known) : 0;
  }
  /// How long a motion's part along the determined directions is, m (rotations by the lever).
  double determined_length_m(const Twist& twist) const;
};

/// How far align() looks about the given pose.
struct AlignmentReach {
  double translation_m = 0.3;                 ///< in any direction
  double rotation_rad = 0.08726646259971647;  ///< 5°
};

/// Where a scan was taken, told by the surfaces of a finished map: localisation without odometry between
/// scans. `scan.T_map_sensor` is a first guess, at most `reach` off. The pose moves only along what the
/// surfaces in view determine; outcome `unexplained` says that the scan fits nowhere or at several places
/// alike.
///
/// The fine step is plane-to-point registration (Chen and Medioni 1992) with robust weights; planes are
/// matched as planes before. Deterministic. 5 to 30 ms a scan, 100 where many surfaces are alike. Throws
/// Error(data) if the pose is not rigid.
class Localizer {
 public:
  /// Looks in `map`'s surfaces, which it keeps.
  explicit Localizer(std::shared_ptr<const Snapshot> map, const AlignmentReach& reach = {});
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;
  ~Localizer();
  /// Where `scan` was taken; one thread at a time.
  Alignment operator()(const Scan& scan);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The same for a single scan; builds what Localizer keeps from scan to scan: O(surfaces near the scan).
Alignment align(const std::shared_ptr<const Snapshot>& map, const Scan& scan,
                const AlignmentReach& reach = {});

}  // namespace octosurf
