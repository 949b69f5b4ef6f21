#include "law/patch_graph.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>

namespace octosurf::law {
namespace {

/// Effort: planes that differ by more than 60° are never one, and heights over a frame between them make
/// little sense.
constexpr double least_cosine = 0.5;

/// Only what is four times smaller may be a tail: of two halves of a wall none is the other's noise.
constexpr double largest_tail = 0.25;

}  // namespace

void PatchGraph::meet(Label a, Label b, const Eigen::Vector3d& at, double pairs) {
  const Contact contact{pairs, 1, at};
  contacts_[a][b].add(contact);
  contacts_[b][a].add(contact);
}

double PatchGraph::gain(Label a, Label b, const Contact& contact) const {
  const Patch &pa = patches_[a], &pb = patches_[b];
  if (pa.plane.normal.dot(pb.plane.normal) < least_cosine) return -std::numeric_limits<double>::infinity();
  // However much a rim between them would cost, a plane that the readings do not belong to tells nothing.
  Patch both = pa;
  both.take(pb);
  if (pa.explained_by(both.plane) < 0 || pb.explained_by(both.plane) < 0)
    return -std::numeric_limits<double>::infinity();
  double evidence = log_same(pa, pb, contact.sum / contact.places);
  const Patch &large = pa.readings < pb.readings ? pb : pa, &small = pa.readings < pb.readings ? pa : pb;
  if (small.readings <= largest_tail * large.readings && contact.pairs > 0)
    evidence = std::max(evidence, log_tail(large, small));
  return evidence + rim_cost * contact.pairs;
}

bool PatchGraph::Candidate::operator<(const Candidate& other) const {
  return std::tuple(gain, other.a, other.b) < std::tuple(other.gain, a, b);  // ties: the first patches
}

void PatchGraph::join(Label into, Label from) {
  patches_[into].take(patches_[from]);
  for (const auto& [other, contact] : contacts_[from]) {
    contacts_[other].erase(from);
    if (other == into) continue;
    contacts_[into][other].add(contact);
    contacts_[other][into].add(contact);
  }
  contacts_[from].clear();
}

PatchGraph::Merged PatchGraph::merge() && {
  std::vector<unsigned> version(patches_.size(), 0);
  std::vector<Label> into(patches_.size());
  std::iota(into.begin(), into.end(), Label{0});
  std::priority_queue<Candidate> queue;
  const auto judge = [&](Label a, Label b, const Contact& contact) {
    if (a > b) std::swap(a, b);
    const double gained = gain(a, b, contact);
    if (gained > 0) queue.push({gained, a, b, version[a], version[b]});
  };
  for (Label a = 1; a < patches_.size(); ++a)
    for (const auto& [b, contact] : contacts_[a])
      if (a < b) judge(a, b, contact);
  while (!queue.empty()) {
    const Candidate best = queue.top();
    queue.pop();
    if (version[best.a] != best.version_a || version[best.b] != best.version_b) continue;
    const bool a_is_larger = patches_[best.a].readings >= patches_[best.b].readings;
    const Label stays = a_is_larger ? best.a : best.b, goes = a_is_larger ? best.b : best.a;
    join(stays, goes);
    into[goes] = stays;
    ++version[stays];
    ++version[goes];
    for (const auto& [other, contact] : contacts_[stays]) judge(stays, other, contact);
  }

  Merged merged;
  std::vector<Label> place(patches_.size(), clutter);
  for (Label a = 0; a < patches_.size(); ++a)
    if (into[a] == a) {
      place[a] = static_cast<Label>(merged.patches.size());
      merged.patches.push_back(patches_[a]);
    }
  for (Label& goal : into) {
    while (into[goal] != goal) goal = into[goal];
  }
  for (Label& goal : into) goal = place[goal];
  merged.into = std::move(into);
  return merged;
}

}  // namespace octosurf::law
