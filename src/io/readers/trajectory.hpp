#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace octosurf::io {

/// No pose is available at the requested time; what() names the frames and the reason.
struct NoPose : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// At no time: tf has no such frame, or does not connect it.
struct NotInTf : NoPose {
  using NoPose::NoPose;
};

/// Longest time between neighbouring poses that is interpolated over. Of files: odometry has 0.02 … 0.1 s.
inline constexpr std::int64_t largest_pose_gap_ns = 100000000;
/// Of bags: linear interpolation between poses T apart deviates by at most a·T²/8 for an acceleration a, 16
/// mm for the 2 m/s² of a walking robot, less than a voxel.
inline constexpr std::int64_t largest_gap_in_bags_ns = 250000000;

/// Nearest within the numbers' range; `seconds` is finite.
std::int64_t to_ns(double seconds);

/// "1305031102.160407000", s.
std::string stamp_text(std::int64_t stamp_ns);

/// One frame's poses in another over time: the pose at any time, where samples are near enough.
class Trajectory {
 public:
  struct Sample {
    std::int64_t stamp_ns = 0;
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    Eigen::Quaternion<double, Eigen::DontAlign> rotation =
        Eigen::Quaternion<double, Eigen::DontAlign>::Identity();
  };
  static Sample sample(double stamp_s, const Eigen::Isometry3d& T);

  void add(const Sample& sample) { samples_.push_back(sample); }
  /// Call after the last add(): sorts by time; of several at one time the last one added is kept. Leaves out
  /// invalid poses, as tf2 does, unless all are.
  void finish();
  std::size_t left_out() const { return left_out_; }
  const std::vector<Sample>& samples() const { return samples_; }
  /// Removes older samples of a finished track.
  void forget_before(std::int64_t stamp_ns);
  bool changes() const { return changes_; }  ///< some sample differed from the first, ever

  /// Why there is no pose at that time, such as "the first is 0.100 s later"; empty: there is one.
  std::string gap_at(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady = false) const;
  /// The sample at exactly that time; else between neighbours that are equal, that pose; else slerp and
  /// linear interpolation between them, if they are at most `gap_ns` apart; else a sample at most
  /// min(20 ms, gap) away. `steady`: one that never changes() holds always. Throws NoPose with gap_at(), and
  /// std::runtime_error if a pose is no rigid motion.
  Eigen::Isometry3d at(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady = false) const;
  /// The last sample until then, or else the first. There must be one.
  Eigen::Isometry3d held_at(std::int64_t stamp_ns) const;

 private:
  struct Place {
    const Sample *before = nullptr, *after = nullptr;  ///< equal: no interpolation; null: none
    std::string gap;
  };
  Place place_of(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady) const;

  std::vector<Sample> samples_;
  std::size_t left_out_ = 0;
  bool changes_ = false;
};

/// T of a sample; throws std::runtime_error if it is no rigid motion.
Eigen::Isometry3d transform_of(const Trajectory::Sample& sample);

}  // namespace octosurf::io
