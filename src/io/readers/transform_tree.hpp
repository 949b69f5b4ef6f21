#pragma once

#include "io/readers/trajectory.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace octosurf::io {

/// tf: frames, each in its parent's, some fixed (/tf_static), some moving (/tf). A frame may have several
/// parents: the one that leads to the requested frame is used.
class TransformTree {
 public:
  struct Edge {
    std::string parent, child;
    bool fixed = false;  ///< holds from its time on, and the first one before it, too
  };
  /// Passes over a frame in itself, or without a name, as tf2 does.
  void add(const Edge& edge, const Trajectory::Sample& sample);
  void finish();
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
  /// "tf has no frame 'lidar', but base, odom"
  std::string lacks(const std::string& frame) const;
  /// From the frame up to its tree's root, by their first transforms.
  std::vector<std::string> ancestors(const std::string& frame) const;
  /// True if a frame between these two, or they themselves, moves.
  bool moves(const std::string& frame) const;
  /// True if a frame below it moves.
  bool moves_below(const std::string& frame) const;

  /// Contradictions in tf about a frame or one above it.
  struct Doubts {
    std::string parents;  ///< "base has two parents at a time, odom and map"
    std::string changed;  ///< "lidar in base": fixed, and not the same throughout
  };
  Doubts doubts_of(const std::string& frame) const;

  /// The time until which later transforms cannot change lookup(): the earliest of the last ones of all
  /// moving frames between these two; the largest number if none moves. Empty: not connected.
  std::optional<std::int64_t> newest(const std::string& to, const std::string& from) const;
  /// Moving frames lose their transforms, as tf2 forgets them when time is set back.
  void forget_moving();

  /// T_to_from at that time; throws as Trajectory::at(), with the frames' names, and NotInTf if the frames
  /// are not connected.
  Eigen::Isometry3d lookup(const std::string& to, const std::string& from, std::int64_t stamp_ns,
                           std::int64_t gap_ns) const;

 private:
  struct Above {
    std::uint32_t parent = 0;
    bool fixed = false;
    Trajectory track;
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
