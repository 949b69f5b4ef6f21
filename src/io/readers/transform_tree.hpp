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
struct NoPose : std::runtime_error {
  explicit NoPose(const std::string& what, std::string of = {})
      : std::runtime_error(what), frame(std::move(of)) {}
  std::string frame;  ///< has no pose in its parent then; empty: not so
};

/// One frame's poses in another over time.
class PoseTrack {
 public:
  struct Sample {
    std::int64_t stamp_ns = 0;
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
  bool changes() const { return changes_; }  ///< some sample differed from the first, ever

  /// The sample at exactly that time; else between neighbours that are equal, that pose; else slerp and
  /// linear interpolation between them, if they are at most `gap_ns` apart; else, before the first and after
  /// the last, a sample at most min(20 ms, gap) away. `steady`: one that never changes() holds always. Throws
  /// NoPose with the distance of the nearest ones, and std::runtime_error if a pose is no rigid motion.
  Eigen::Isometry3d at(std::int64_t stamp_ns, std::int64_t gap_ns, bool steady = false) const;
  /// The last sample until then, or else the first. There must be one.
  Eigen::Isometry3d held_at(std::int64_t stamp_ns) const;

 private:
  std::vector<Sample> samples_;
  std::size_t left_out_ = 0;
  bool changes_ = false;
};

/// True for the frames that stand still: REP 105's, and LOAM's camera_init.
bool is_map_frame(std::string_view frame);

/// tf: frames, each in its parent's, some fixed (/tf_static), some moving (/tf). A frame may have several
/// parents: the one that leads to the frame that is asked for is taken.
class TransformTree {
 public:
  struct Edge {
    std::string parent, child;
    bool fixed = false;  ///< holds from its time on, and the first one before it, too
  };
  /// Passes over a frame in itself, or without a name, as tf2 does.
  void add(const Edge& edge, const PoseTrack::Sample& sample);
  void finish();
  /// Adds a finished tree, unless both say where one frame is: then nothing, and false.
  bool join(const TransformTree& other);
  /// Something else moves: what never changes holds always, however seldom it was sent. finish() finds this
  /// where it is tf that moves.
  void hold_steady() { steady_ = true; }
  /// Removes samples of moving frames older than this before each one's last transform. The tree must be
  /// finished.
  void keep_last(std::int64_t duration_ns);

  std::size_t size() const { return frames_.size(); }  ///< frames
  /// Of moving frames' tracks, and the first such frame; 0: none.
  std::pair<std::size_t, std::string> left_out() const;
  bool knows(const std::string& frame) const { return indices_.contains(frame); }
  /// From the frame up to its tree's root, by their first transforms.
  std::vector<std::string> ancestors(const std::string& frame) const;
  /// True if a frame between these two, or they themselves, moves.
  bool moves(const std::string& frame) const;

  /// What tf says of a frame, or of one above it, in two ways.
  struct Doubts {
    std::string parents;       ///< "base has two parents at a time, odom and map"
    std::string disagreement;  ///< "two publishers of odom -> base disagree, by 0.52 m"
    std::string changed;       ///< "lidar in base": fixed, and not the same throughout
  };
  Doubts doubts_of(const std::string& frame) const;

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
  struct Above {
    std::uint32_t parent = 0;
    bool fixed = false;
    PoseTrack track;
  };
  struct Frame {
    std::string name;
    std::vector<Above> above;  ///< one for each parent, moving ones first
    bool moves() const { return !above.empty() && !above.front().fixed; }
  };
  struct Step {
    std::uint32_t frame = 0;
    Eigen::Isometry3d T_frame_start = Eigen::Isometry3d::Identity();
  };
  std::optional<std::uint32_t> parent_of(const Frame& frame) const;
  std::vector<std::uint32_t> children_of(std::uint32_t frame) const;
  std::uint32_t index_of(const std::string& frame);
  Above& above_of(std::uint32_t child, std::uint32_t parent, bool fixed);
  struct Way {
    std::vector<Step> steps;       ///< the frame and all above it, nearest first
    std::optional<NoPose> broken;  ///< the first that has no pose
  };
  Way up(std::uint32_t start, std::optional<std::uint32_t> stop, std::int64_t stamp_ns,
         std::int64_t gap_ns) const;

  std::vector<Frame> frames_;
  std::map<std::string, std::uint32_t> indices_;
  bool steady_ = false;
};

}  // namespace octosurf::io
