#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tsl/robin_map.h>
#include <utility>
#include <vector>

namespace octosurf::surfaces {

/// Numbers that describe a sensor's own error (alignment/sensor_error.hpp).
inline constexpr int sensor_error_size = 10;

/// What scans have read of a patch: means over their readings.
struct Look {
  float weight = 0;    ///< 1/m², of `distance`; 0: never looked at
  float distance = 0;  ///< m, off the patch's plane
  /// Derivative of `distance` by the sensor's error.
  Eigen::Matrix<float, sensor_error_size, 1> by_error = decltype(by_error)::Zero();

  void add(const Look& other);
};

/// A piece of a surface, and where readings of it lay, old ones apart from new ones: of the last one to two
/// `span` metres of way, which `recent` and `waiting` hold, and of all before, which `past` does.
struct Patch {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< of the surface when the patch was first seen
  double offset = 0;                                  ///< n·x = offset
  double since = 0;                                   ///< way, m, at which `recent` began …
  double until = 0;                                   ///< … and at which it was added to last
  Look past, waiting, recent;

  /// All that was read at least `span` metres of way before `way`.
  Look before(double way, double span) const;
  void add(const Look& look, double way, double span);
};

/// The patches that a recording has seen, by PatchKey (alignment/revisit.hpp). O(1) each.
class SeenPatches {
 public:
  using Key = std::uint64_t;
  using Change = std::pair<Key, Patch>;

  const Patch* find(Key key) const {
    const auto at = patches_.find(key);
    return at == patches_.end() ? nullptr : &at->second;
  }
  std::size_t size() const { return patches_.size(); }
  /// Ascending keys.
  std::vector<Change> all() const;
  void set(Key key, const Patch& patch);

  /// From here on what was is kept, until commit() or roll_back(), which takes no memory.
  void begin_changes() noexcept { before_.clear(); }
  void commit() noexcept { before_.clear(); }
  void roll_back() noexcept;

 private:
  tsl::robin_map<Key, Patch> patches_;
  std::vector<std::pair<Key, std::optional<Patch>>> before_;
};

}  // namespace octosurf::surfaces
