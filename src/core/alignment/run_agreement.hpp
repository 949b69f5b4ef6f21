#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include <octosurf/agreement.hpp>
#include <octosurf/alignment.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// Whether the scans of a run contradict one another, judged against the run itself: a map that holds two
/// versions of a wall agrees with both, so that only the scans at which poses, clock or sensor change stand
/// out.
class RunAgreement {
 public:
  /// Of right recordings half of the scans agree by more, whatever drifts or walks about in them.
  static constexpr double usual = 0.9;
  /// Of the run's median, or of `usual`: a scan that agrees by less contradicts the map.
  static constexpr double much_less = 0.8;
  /// Samples that must have been compared for a scan to be judged.
  static constexpr std::size_t fewest_compared = 100;

  /// A scan at its stated pose, and of its report agreement and alignment. O(1).
  void add(const Scan& scan, const Agreement& agreement, const Alignment& alignment = {});

  std::size_t scans() const { return judged_.size(); }  ///< that could be judged
  double median() const;                                ///< share; 1 if no scan could be judged
  double least() const;                                 ///< likewise

  /// Scans that contradict the map; also those that did so before alignment moved them or left them out, if
  /// the poses jump there.
  struct Contradiction {
    std::size_t scans = 0;  ///< how many
    std::size_t moved = 0;  ///< of these, by alignment, or left out
    std::size_t first = 0;  ///< index of the first among all that were added
    double stamp_s = 0;     ///< of it
    double share = 0;       ///< mean agreement of these
    /// Where alignment moved the scans that follow onto the map: by how much more than those before, m. Else
    /// the step from the pose before the first to its own, if most steps are far smaller, or 0.
    double jump_m = 0;
    double jump_rad = 0;      ///< likewise
    bool alternates = false;  ///< scans that agree and scans that do not take turns: two tracks
  };
  /// None if no scan does. O(scans).
  std::optional<Contradiction> contradiction() const;

 private:
  struct Judged {
    std::size_t scan;
    double stamp_s, share, step_m, step_rad;
    bool relocated;             // or left out
    double moved_m, moved_rad;  // by alignment, if it was relocated, against the last scan that was not
  };
  std::vector<Judged> judged_;
  std::vector<double> steps_m_, steps_rad_;  // between all scans
  std::optional<Eigen::Isometry3d> last_;
  Eigen::Isometry3d correction_ = Eigen::Isometry3d::Identity();  // of the last scan that was not relocated
};

}  // namespace octosurf::alignment
