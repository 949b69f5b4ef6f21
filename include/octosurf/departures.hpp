#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <octosurf/ids.hpp>

namespace octosurf {

/// A surface or cylinder that is no more. Its id is never used again.
struct Departure {
  /// What has gone.
  enum class Of { surface, cylinder };
  Of of = Of::surface;             ///< what has gone
  std::uint32_t id = 0;            ///< its id while it was there
  std::uint32_t into = 0;          ///< what took it in; 0: its points went back to pending, or vanished
  std::uint64_t born = 0;          ///< map revision in which it appeared; 0: before maps noted that
  std::uint64_t revision = 0;      ///< map revision in which it went
  std::vector<SurfaceId> parents;  ///< as Surface::parents, when it went; none of a cylinder

  friend bool operator==(const Departure&, const Departure&) = default;
};

/// All departures of a map, in the order in which they happened. Never changes, cheap to copy and to keep.
class DepartureLog {
 public:
  std::size_t size() const { return size_; }  ///< number of departures
  /// Those after `revision`, oldest first. O(log n) and O(1) each.
  void for_each_since(std::uint64_t revision, const std::function<void(const Departure&)>& visit) const;
  /// This one and, after its last, `more`; their revisions must not descend. O(more), and O(n) / 256.
  DepartureLog with(const std::vector<Departure>& more) const;

 private:
  using Chunk = std::vector<Departure>;
  std::vector<std::shared_ptr<const Chunk>> chunks_;
  std::size_t size_ = 0;
};

}  // namespace octosurf
