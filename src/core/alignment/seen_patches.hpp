#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>
#include <utility>
#include <vector>

namespace octosurf::alignment {

/// Size of the sensor's error vector (alignment/sensor_error.hpp).
inline constexpr int sensor_error_size = 10;

/// Means over the readings that scans made of a patch.
struct Observation {
  float weight = 0;    ///< 1/m², of `distance`; 0: no readings
  float distance = 0;  ///< m, off the patch's plane
  /// Derivative of `distance` by the sensor's error.
  Eigen::Matrix<float, sensor_error_size, 1> by_error = decltype(by_error)::Zero();

  void add(const Observation& other);
};

/// A piece of a surface with its readings, old ones separate from new ones: `recent` and `waiting` are of the
/// last one to two `span` metres of travel, `past` of the time before.
struct SeenPatch {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< of the surface when the patch was first seen
  double offset = 0;                                  ///< n·x = offset
  double since = 0;                                   ///< travel, m, at which `recent` began …
  double until = 0;                                   ///< … and of its last addition
  Observation past, waiting, recent;

  /// All readings made at least `span` metres of travel before `way`.
  Observation before(double way, double span) const;
  void add(const Observation& observation, double way, double span);
};

/// The patches seen in a recording, by PatchKey (alignment/revisit.hpp). O(1) each.
class SeenPatches {
 public:
  using Key = std::uint64_t;
  using Change = std::pair<Key, SeenPatch>;

  const SeenPatch* find(Key key) const {
    const auto at = patches_.find(key);
    return at == patches_.end() ? nullptr : &at->second;
  }
  std::size_t size() const { return patches_.size(); }
  void set(Key key, const SeenPatch& patch);

  /// Files keep patches in blocks of 8 × 8 columns along an axis: a key without its columns' low bits and its
  /// height.
  static Key block_of(Key key) { return key & ~(Key{7} << 40 | Key{7} << 20 | 0xfffff); }
  std::vector<Change> in_block(Key block) const;  ///< ascending keys
  std::vector<Key> blocks() const;                ///< ascending
  /// Those of patches that were set, or taken back, since the last call.
  std::vector<Key> take_changed_blocks() const;

  /// Starts recording the previous state until commit() or roll_back(), which need no memory.
  void begin_changes() noexcept { before_.clear(); }
  void commit() noexcept { before_.clear(); }
  void roll_back() noexcept;

 private:
  tsl::robin_map<Key, SeenPatch> patches_;
  tsl::robin_map<Key, std::vector<Key>> blocks_;  // their keys
  mutable tsl::robin_set<Key> changed_;           // blocks
  std::vector<std::pair<Key, std::optional<SeenPatch>>> before_;
};

}  // namespace octosurf::alignment
