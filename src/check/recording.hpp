#pragma once

#include "judgement/oddities.hpp"
#include "judgement/spread.hpp"

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::check {

/// A recording as it is given: some of its scans, the poses of all.
class Recording {
 public:
  struct Pose {
    std::string name;
    double stamp_s = 0;
    Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
    std::optional<judgement::Oddities::Kind> oddity;
  };
  struct KeptScan {
    std::size_t index = 0;  ///< of its pose
    Scan scan;              ///< without what is no reading, thinned
  };

  explicit Recording(const Parameters& parameters) : parameters_(parameters) {}
  void add(const Scan& scan);

  const Parameters& parameters() const { return parameters_; }
  const std::vector<Pose>& poses() const { return poses_; }
  const std::vector<KeptScan>& kept() const { return kept_.kept(); }
  bool is_camera() const { return !kept().empty() && kept().front().scan.sensor == SensorKind::depth_camera; }
  /// m, of the kept scans' readings.
  double median_range() const;
  /// m: the range (of a camera: the depth) that more readings have than any other, to the millimetre; empty
  /// if fewer than one in a hundred have.
  std::optional<double> most_frequent_range() const;
  /// The scan after the longest step of the poses that stands out.
  std::optional<std::size_t> jump() const;

 private:
  static constexpr std::size_t most_kept = 72;  // twice as many as views are compared
  Parameters parameters_;
  std::vector<Pose> poses_;
  judgement::Spread<KeptScan> kept_{most_kept};
  judgement::Oddities oddities_;
};

/// Whether all rotations are one. Empty, or ends with "; ".
std::string facts_of(const Recording& recording);

}  // namespace octosurf::check
