#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace octosurf::io {

/// No pose is available at the requested time; what() names the frames and the reason.
class NoPose : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One frame's poses in another over time.
class PoseTrack {
 public:
  struct Sample {
    std::int64_t stamp_ns = 0;
    std::uint32_t parent = 0;  ///< meaning defined by the caller
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    Eigen::Quaternion<double, Eigen::DontAlign> rotation =
        Eigen::Quaternion<double, Eigen::DontAlign>::Identity();
  };

  void add(const Sample& sample) { samples_.push_back(sample); }
  /// Call after the last add(): sorts by time; of several at one time the last one added is kept. Leaves out
  /// what is no pose, as tf2 does, unless all are.
  void finish();
  std::size_t left_out() const { return left_out_; }
  const std::vector<Sample>& samples() const { return samples_; }
  /// Removes older samples of a finished track.
  void forget_before(std::int64_t stamp_ns);

  struct At {
    std::uint32_t parent = 0;
    Eigen::Isometry3d T_parent_child = Eigen::Isometry3d::Identity();
  };
  /// The sample at exactly that time; else slerp and linear interpolation between the neighbours, if they are
  /// at most `gap_ns` apart and have one parent; else, before the first and after the last, a sample at most
  /// min(20 ms, gap) away. Throws NoPose with the distance of the nearest ones, and std::runtime_error if a
  /// pose is no rigid motion.
  At at(std::int64_t stamp_ns, std::int64_t gap_ns) const;

 private:
  std::vector<Sample> samples_;
  std::size_t left_out_ = 0;
};

/// True for the frames that stand still: REP 105's, and LOAM's camera_init.
bool is_map_frame(std::string_view frame);

/// tf: frames, each in its parent's, some fixed (/tf_static), some moving (/tf).
class TransformTree {
 public:
  struct Edge {
    std::string parent, child;
    bool fixed = false;  ///< valid at all times; the last one added is used
  };
  void add(const Edge& edge, PoseTrack::Sample sample);
  void finish();
  /// Removes samples of moving frames older than this before each one's last transform. The tree must be
  /// finished.
  void keep_last(std::int64_t duration_ns);

  std::size_t size() const { return frames_.size(); }  ///< frames
  /// Of the frames' tracks, and the first such frame; 0: none.
  std::pair<std::size_t, std::string> left_out() const;
  bool knows(const std::string& frame) const { return indices_.contains(frame); }
  /// From the frame up to its tree's root, by their first transforms.
  std::vector<std::string> ancestors(const std::string& frame) const;
  /// True if a frame between these two, or they themselves, moves.
  bool moves(const std::string& frame) const;

  /// The robot below a frame that stands still: the one frame that moves in it, or behind further ones that
  /// stand still, and from there the end of fixed transforms, as long as frames have one child. Empty: none,
  /// or several.
  std::string robot_below(const std::string& frame) const;

  /// The time until which later transforms, in order of time, cannot change lookup(): the earliest of the
  /// last ones of all moving frames between these two; the largest number if none moves. Empty: not
  /// connected.
  std::optional<std::int64_t> newest(const std::string& to, const std::string& from) const;
  bool settled(const std::string& to, const std::string& from, std::int64_t stamp_ns) const {
    const auto last = newest(to, from);
    return last && *last >= stamp_ns;
  }
  /// Moving frames lose their transforms, as tf2 forgets them when time is set back.
  void forget_moving();

  /// T_to_from at that time; throws as PoseTrack::at(), with the frames' names, and NoPose if the frames are
  /// not connected.
  Eigen::Isometry3d lookup(const std::string& to, const std::string& from, std::int64_t stamp_ns,
                           std::int64_t gap_ns) const;

 private:
  struct Frame {
    std::string name;
    std::optional<PoseTrack::Sample> fixed;
    PoseTrack track;
  };
  struct Step {
    std::uint32_t frame = 0;
    Eigen::Isometry3d T_frame_start = Eigen::Isometry3d::Identity();
  };
  std::optional<std::uint32_t> parent_of(const Frame& frame) const;
  std::vector<std::uint32_t> children_of(std::uint32_t frame) const;
  std::uint32_t index_of(const std::string& frame);
  struct Way {
    std::vector<Step> steps;
    std::string broken;  ///< why the chain ends before the root; empty: it does not
  };
  Way up(std::uint32_t start, std::optional<std::uint32_t> stop, std::int64_t stamp_ns,
         std::int64_t gap_ns) const;

  std::vector<Frame> frames_;
  std::map<std::string, std::uint32_t> indices_;
};

}  // namespace octosurf::io
