#pragma once

#include "law/segmentation.hpp"

#include <cstddef>
#include <vector>

namespace octosurf::law {

/// Where planes meet at an angle, as those of a wall and of a board before it: which readings may be
/// either's, and between which the other plane passes.
class Junctions {
 public:
  using Index = Readings::Index;

  /// O(readings).
  Junctions(const Readings& readings, const std::vector<Label>& labels, const std::vector<Patch>& patches);

  /// A plane at an angle beside it explains the reading, too: it joins nothing, and planes are fitted without
  /// it. Never true of context.
  bool ambiguous(Index i) const { return ambiguous_[i]; }
  /// A plane at an angle beside one of the two passes between them. Surfaces are opaque: what is seen of a
  /// wall above a board and below it is two, however near.
  bool parted(Index i, Index j) const { return passes_beside(i, i, j) || passes_beside(j, i, j); }

 private:
  bool passes_beside(Index beside, Index i, Index j) const;

  const Readings& readings_;
  std::vector<Plane> planes_;       // by label; the patches are moved on
  std::vector<std::size_t> first_;  // of each reading, in `beside_`
  std::vector<Label> beside_;       // whose planes stand at an angle to its own
  std::vector<bool> ambiguous_;
};

}  // namespace octosurf::law
