#include "detection/patch_graph.hpp"

#include "detection/constants.hpp"

#include <limits>
#include <numeric>
#include <tuple>

namespace octosurf::detection {
void PatchGraph::meet(Label a, Label b, const Eigen::Vector3d& at, double pairs) {
  const Contact contact{.pairs = pairs, .places = 1, .sum = at, .judged = {}};
  contacts_[a][b].add(contact);
  contacts_[b][a].add(contact);
}

double gain_of_merging(const Patch& a, const Patch& b, const Eigen::Vector3d& at, double pairs) {
  if (a.plane.normal.dot(b.plane.normal) < Constants::least_cosine)
    return -std::numeric_limits<double>::infinity();
  double evidence = log_same(a, b, at);
  const Patch &large = a.readings < b.readings ? b : a, &small = a.readings < b.readings ? a : b;
  if (small.readings <= Constants::largest_tail * large.readings && pairs > 0)
    evidence = std::max(evidence, log_tail(large, small));
  const double gained = evidence + Constants::boundary_cost * pairs;
  if (!(gained > 0)) return gained;
  // Whatever a boundary between them would cost, a plane that the readings do not fit explains nothing.
  Patch both = a;
  both.take(b);
  if (a.explained_by(both.plane) < 0 || b.explained_by(both.plane) < 0)
    return -std::numeric_limits<double>::infinity();
  return gained;
}

bool PatchGraph::Candidate::operator<(const Candidate& other) const {
  return std::tuple(gain, other.a, other.b) < std::tuple(other.gain, a, b);  // ties: the first patches
}

void PatchGraph::Contact::add(const Contact& other) {
  pairs += other.pairs;
  places += other.places;
  sum += other.sum;
  judged.reset();
}

void PatchGraph::judge(Label a, Label b) {
  if (a > b) std::swap(a, b);
  Contact& contact = contact_of(a, b);
  contact.judged = age(a, b);
  const double gained =
      gain_of_merging(patches_[a], patches_[b], contact.sum / contact.places, contact.pairs);
  if (gained > 0) queue_.push({gained, a, b, age(a, b)});
}

void PatchGraph::rescore_changed_pairs() {
  for (Label a = 1; a < patches_.size(); ++a)
    for (const auto& [b, contact] : contacts_[a])
      if (a < b && contact.judged != age(a, b)) judge(a, b);
}

/// The larger patch stays and takes over the other's contacts, which are evaluated anew; its own contacts are
/// not, since it has grown little.
void PatchGraph::join(Label a, Label b) {
  const bool a_is_larger = patches_[a].readings >= patches_[b].readings;
  const Label stays = a_is_larger ? a : b, goes = a_is_larger ? b : a;
  patches_[stays].take(patches_[goes]);
  into_[goes] = stays;
  ++mergers_[stays];
  const Contacts of_the_other = std::move(contacts_[goes]);
  contacts_[goes].clear();
  for (const auto& [other, contact] : of_the_other) {
    contacts_[other].erase(goes);
    if (other == stays) continue;
    contacts_[stays][other].add(contact);
    contacts_[other][stays].add(contact);
    judge(stays, other);
  }
}

PatchGraph::Merged PatchGraph::merge() && {
  into_.resize(patches_.size());
  std::iota(into_.begin(), into_.end(), Label{0});
  for (rescore_changed_pairs(); !queue_.empty();) {
    const Candidate best = queue_.top();
    queue_.pop();
    if (contacts_[best.a].contains(best.b)) {
      if (best.age == age(best.a, best.b))
        join(best.a, best.b);
      else
        judge(best.a, best.b);
    }
    if (queue_.empty()) rescore_changed_pairs();
  }
  return what_is_left();
}

PatchGraph::Merged PatchGraph::what_is_left() {
  Merged merged;
  std::vector<Label> place(patches_.size(), clutter);
  for (Label a = 0; a < patches_.size(); ++a)
    if (into_[a] == a) {
      place[a] = static_cast<Label>(merged.patches.size());
      merged.patches.push_back(patches_[a]);
    }
  for (Label& goal : into_) {
    while (into_[goal] != goal) goal = into_[goal];
  }
  for (Label& goal : into_) goal = place[goal];
  merged.into = std::move(into_);
  return merged;
}

}  // namespace octosurf::detection
