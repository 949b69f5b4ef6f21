#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <octosurf/ids.hpp>

namespace octosurf {

/// A removed surface or cylinder. Its id is never reused.
struct Removal {
  /// Kind of the removed object.
  enum class Of { surface, cylinder };
  Of of = Of::surface;             ///< kind
  std::uint32_t id = 0;            ///< its former id
  std::uint32_t into = 0;          ///< the object that absorbed it; 0: its points became pending or vanished
  std::uint64_t born = 0;          ///< map revision in which it appeared
  std::uint64_t revision = 0;      ///< map revision in which it was removed
  std::vector<SurfaceId> parents;  ///< Surface::parents at removal; empty for a cylinder

  friend bool operator==(const Removal&, const Removal&) = default;
};

/// All removals of a map in chronological order. Immutable, cheap to copy and keep.
class RemovalLog {
 public:
  std::size_t size() const { return size_; }  ///< number of removals
  /// Those after `revision`, oldest first. O(log n) and O(1) each.
  void for_each_since(std::uint64_t revision, const std::function<void(const Removal&)>& visit) const;
  /// A copy with `more` appended, whose revisions must not descend. O(more), and O(n) / 256.
  RemovalLog with(const std::vector<Removal>& more) const;

 private:
  using Chunk = std::vector<Removal>;
  std::vector<std::shared_ptr<const Chunk>> chunks_;
  std::size_t size_ = 0;
};

}  // namespace octosurf
