#pragma once

#include "detection/segmentation.hpp"

#include <cstdint>
#include <vector>

namespace octosurf::detection {

/// Where planes meet at an angle, such as a wall and a board in front of it: finds readings that fit both,
/// and pairs of readings separated by the other plane.
class Junctions {
 public:
  using Index = Readings::Index;

  /// O(readings).
  Junctions(const Readings& readings, const std::vector<Label>& labels, const std::vector<Patch>& patches);
  /// Updates after labels were renamed, joined, removed, or split between unconnected readings: readings
  /// whose neighbours all had one label are unchanged. O(readings with neighbours of another label).
  void renew(const std::vector<Label>& labels, const std::vector<Patch>& patches);

  /// A plane at an angle beside it also explains the reading: it connects nothing, and planes are fitted
  /// without it. Never true of context.
  bool ambiguous(Index i) const { return ambiguous_[i]; }
  /// A plane at an angle beside one of the two passes between them. Surfaces are opaque: the parts of a wall
  /// above and below a board are separate, however near.
  bool separated_by_plane(Index i, Index j) const { return passes_beside(i, i, j) || passes_beside(j, i, j); }
  /// The labelled readings with neighbours of another label, ascending: contacts of patches.
  const std::vector<Index>& contacts() const { return contacts_; }

 private:
  struct Beside {
    std::uint32_t first = 0, count = 0;  // in `beside_`
  };
  void find_beside(Index i, const std::vector<Label>& labels);
  bool passes_beside(Index beside, Index i, Index j) const;

  const Readings* readings_;
  std::vector<Plane> planes_;  // by label; a copy, because the patches change
  std::vector<Index> contacts_;
  std::vector<Beside> of_;     // of each reading
  std::vector<Label> beside_;  // labels of planes at an angle to the reading's own
  std::vector<bool> ambiguous_;
};

}  // namespace octosurf::detection
