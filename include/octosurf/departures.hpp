#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <octosurf/ids.hpp>

namespace octosurf {

/// A removed surface or cylinder. Its id is never reused.
struct Departure {
  /// Kind of the removed object.
  enum class Of { surface, cylinder };
  Of of = Of::surface;             ///< kind
  std::uint32_t id = 0;            ///< its former id
  std::uint32_t into = 0;          ///< the object that absorbed it; 0: its points became pending or vanished
  std::uint64_t born = 0;          ///< map revision in which it appeared
  std::uint64_t revision = 0;      ///< map revision in which it was removed
  std::vector<SurfaceId> parents;  ///< Surface::parents at removal; empty for a cylinder

  friend bool operator==(const Departure&, const Departure&) = default;
};

/// All departures of a map in chronological order. Immutable, cheap to copy and keep.
class DepartureLog {
 public:
  std::size_t size() const { return size_; }  ///< number of departures
  /// Those after `revision`, oldest first. O(log n) and O(1) each.
  void for_each_since(std::uint64_t revision, const std::function<void(const Departure&)>& visit) const;
  /// A copy with `more` appended, whose revisions must not descend. O(more), and O(n) / 256.
  DepartureLog with(const std::vector<Departure>& more) const;

 private:
  using Chunk = std::vector<Departure>;
  std::vector<std::shared_ptr<const Chunk>> chunks_;
  std::size_t size_ = 0;
};

}  // namespace octosurf
