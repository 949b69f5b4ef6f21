#include "alignment/seen_patches.hpp"

#include <algorithm>

namespace octosurf::alignment {

void Observation::add(const Observation& other) {
  if (!(other.weight > 0)) return;
  weight += other.weight;
  const float share = other.weight / weight;
  distance += share * (other.distance - distance);
  by_error += share * (other.by_error - by_error);
}

Observation SeenPatch::before(double way, double span) const {
  Observation observation = past;
  if (way - since >= span) observation.add(waiting);
  if (way - until >= span) observation.add(recent);
  return observation;
}

void SeenPatch::add(const Observation& observation, double way, double span) {
  if (way - since >= span) {
    past = before(way, span);
    waiting = way - until >= span ? Observation{} : recent;
    recent = {};
    since = way;
  }
  recent.add(observation);
  until = way;
}

std::vector<SeenPatches::Change> SeenPatches::all() const {
  std::vector<Change> all(patches_.begin(), patches_.end());
  std::sort(all.begin(), all.end(), [](const Change& a, const Change& b) { return a.first < b.first; });
  return all;
}

void SeenPatches::set(Key key, const SeenPatch& patch) {
  const auto at = patches_.find(key);
  before_.emplace_back(key, at == patches_.end() ? std::nullopt : std::optional(at->second));
  patches_[key] = patch;
}

void SeenPatches::roll_back() noexcept {
  for (auto change = before_.rbegin(); change != before_.rend(); ++change) {
    const auto at = patches_.find(change->first);
    if (at == patches_.end()) continue;  // the change that failed
    if (change->second)
      at.value() = *change->second;
    else
      patches_.erase(at);
  }
  before_.clear();
}

}  // namespace octosurf::alignment
