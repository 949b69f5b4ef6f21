#pragma once

#include "law/readings.hpp"

#include <map>
#include <vector>

namespace octosurf::law {

/// Nats for each pair of neighbouring voxels that the rim between two planes would part: the prior that
/// surfaces are wholes (Potts). Tuned: half of it cuts noisy walls up, twice as much changes nothing.
inline constexpr double rim_cost = 0.5;

/// Patches and where they meet. Merges what one plane explains better than two, best first.
class PatchGraph {
 public:
  /// patches[clutter] stands for clutter and meets nothing.
  explicit PatchGraph(std::vector<Patch> patches)
      : patches_(std::move(patches)), contacts_(patches_.size()) {}

  /// Two patches meet at `at`, with so many pairs of neighbouring voxels: none across a gap.
  void meet(Label a, Label b, const Eigen::Vector3d& at, double pairs);
  bool met(Label a, Label b) const { return contacts_[a].contains(b); }
  const Patch& operator[](Label a) const { return patches_[a]; }

  /// Merges until nothing is gained. The patches that are left, and where each of the former ones went.
  /// O(merges · contacts of a patch).
  struct Merged {
    std::vector<Patch> patches;
    std::vector<Label> into;
  };
  Merged merge() &&;

 private:
  struct Contact {
    double pairs = 0, places = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of the places
    void add(const Contact& other) {
      pairs += other.pairs;
      places += other.places;
      sum += other.sum;
    }
  };
  struct Candidate {
    double gain;
    Label a, b;
    unsigned version_a, version_b;  // of the patches when it was judged
    bool operator<(const Candidate& other) const;
  };

  double gain(Label a, Label b, const Contact& contact) const;
  void join(Label into, Label from);

  std::vector<Patch> patches_;
  std::vector<std::map<Label, Contact>> contacts_;  // of each patch, by the other; kept for both
};

}  // namespace octosurf::law
