#pragma once

#include "detection/readings.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <queue>
#include <vector>

namespace octosurf::detection {

/// Nats by which one plane explains two patches better than two planes: the merge criterion. They meet at
/// `at`, with `pairs` pairs of neighbouring voxels.
double gain_of_merging(const Patch& a, const Patch& b, const Eigen::Vector3d& at, double pairs);

/// Patches and their contacts. Merges those that one plane explains better than two, best first.
class PatchGraph {
 public:
  /// patches[clutter] is a placeholder without contacts.
  explicit PatchGraph(std::vector<Patch> patches)
      : patches_(std::move(patches)), contacts_(patches_.size()), mergers_(patches_.size(), 0) {}

  /// Adds a contact of two patches at `at`, with `pairs` pairs of neighbouring voxels: 0 across a gap.
  void meet(Label a, Label b, const Eigen::Vector3d& at, double pairs);
  bool met(Label a, Label b) const { return contacts_[a].contains(b); }
  const Patch& operator[](Label a) const { return patches_[a]; }

  /// Merges until no contact gains anything at its current patches. Returns the remaining patches, and the
  /// successor of each former one. O(contacts), some times: a contact's gain is recomputed when its turn
  /// comes or no other is left, not whenever one of the two has grown.
  struct Merged {
    std::vector<Patch> patches;
    std::vector<Label> into;
  };
  Merged merge() &&;

 private:
  struct Contact {
    double pairs = 0, places = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of the places
    std::optional<unsigned> judged;                 // age of the two at the contact's last evaluation
    void add(const Contact& other);
  };
  struct Candidate {
    double gain;
    Label a, b;
    unsigned age;  // of the two at its evaluation
    bool operator<(const Candidate& other) const;
  };
  using Contacts = std::map<Label, Contact>;

  unsigned age(Label a, Label b) const { return mergers_[a] + mergers_[b]; }
  Contact& contact_of(Label a, Label b) { return contacts_[std::min(a, b)].at(std::max(a, b)); }
  void judge(Label a, Label b);
  void rescore_changed_pairs();
  void join(Label a, Label b);
  Merged what_is_left();

  std::vector<Patch> patches_;
  std::vector<Contacts> contacts_;  // by the other; stored twice, evaluated at the smaller label
  std::vector<unsigned> mergers_;   // of each patch so far
  std::vector<Label> into_;         // the patch that absorbed it, or itself
  std::priority_queue<Candidate> queue_;
};

}  // namespace octosurf::detection
