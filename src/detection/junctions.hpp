#pragma once

#include "detection/segmentation.hpp"

#include <cstdint>
#include <vector>

namespace octosurf::detection {

/// Where planes meet at an angle, as those of a wall and of a board before it: which readings may be
/// either's, and between which the other plane passes.
class Junctions {
 public:
  using Index = Readings::Index;

  /// O(readings).
  Junctions(const Readings& readings, const std::vector<Label>& labels, const std::vector<Patch>& patches);
  /// The same anew, once labels were renamed, joined, taken away, or parted where nothing conducts: where all
  /// neighbours had one label nothing has come. O(readings with neighbours of another label).
  void renew(const std::vector<Label>& labels, const std::vector<Patch>& patches);

  /// A plane at an angle beside it explains the reading, too: it joins nothing, and planes are fitted without
  /// it. Never true of context.
  bool ambiguous(Index i) const { return ambiguous_[i]; }
  /// A plane at an angle beside one of the two passes between them. Surfaces are opaque: what is seen of a
  /// wall above a board and below it is two, however near.
  bool parted(Index i, Index j) const { return passes_beside(i, i, j) || passes_beside(j, i, j); }
  /// The readings that have a label and neighbours of another one, ascending: where patches touch.
  const std::vector<Index>& contacts() const { return contacts_; }

 private:
  struct Beside {
    std::uint32_t first = 0, count = 0;  // in `beside_`
  };
  void find_beside(Index i, const std::vector<Label>& labels);
  bool passes_beside(Index beside, Index i, Index j) const;

  const Readings* readings_;
  std::vector<Plane> planes_;  // by label; the patches are moved on
  std::vector<Index> contacts_;
  std::vector<Beside> of_;     // of each reading
  std::vector<Label> beside_;  // whose planes stand at an angle to its own
  std::vector<bool> ambiguous_;
};

}  // namespace octosurf::detection
