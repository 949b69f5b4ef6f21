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
  std::uint64_t id = 0;            ///< its former id
  std::uint64_t into = 0;          ///< the object that absorbed it; 0: its points became pending or vanished
  std::uint64_t born = 0;          ///< map revision in which it appeared
  std::uint64_t revision = 0;      ///< map revision in which it was removed
  std::vector<SurfaceId> parents;  ///< Surface::parents at removal; empty for a cylinder

  friend bool operator==(const Removal&, const Removal&) = default;
};

/// The removals of a map in chronological order, the last 10⁵ or more. Immutable, cheap to copy and keep.
class RemovalLog {
 public:
  /// An empty one; what was left out before.
  explicit RemovalLog(std::uint64_t left_out = 0, std::uint64_t complete_since = 0)
      : left_out_(left_out), complete_since_(complete_since) {}
  std::size_t size() const { return size_; }            ///< number of removals
  std::uint64_t left_out() const { return left_out_; }  ///< number of removals before the first
  /// All after this revision are here; earlier ones may not be.
  std::uint64_t complete_since() const { return complete_since_; }
  /// Those after `revision`, oldest first. O(log n) and O(1) each.
  void for_each_since(std::uint64_t revision, const std::function<void(const Removal&)>& visit) const;
  /// A copy with `more` appended, whose revisions must not descend, and without the oldest beyond 10⁵.
  /// O(more), and O(n) / 256.
  RemovalLog with(const std::vector<Removal>& more) const;

 private:
  using Chunk = std::vector<Removal>;
  std::vector<std::shared_ptr<const Chunk>> chunks_;
  std::size_t size_ = 0;
  std::uint64_t left_out_, complete_since_;
};

}  // namespace octosurf
