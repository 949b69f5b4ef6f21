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

std::vector<SeenPatches::Key> SeenPatches::blocks() const {
  std::vector<Key> all;
  for (const auto& [block, keys] : blocks_) all.push_back(block);
  std::ranges::sort(all);
  return all;
}

std::vector<SeenPatches::Change> SeenPatches::in_block(Key block) const {
  std::vector<Change> all;
  if (const auto keys = blocks_.find(block); keys != blocks_.end())
    for (const Key key : keys->second) all.emplace_back(key, *find(key));
  std::ranges::sort(all, {}, &Change::first);
  return all;
}

std::vector<SeenPatches::Key> SeenPatches::take_changed_blocks() const {
  std::vector<Key> blocks(changed_.begin(), changed_.end());
  changed_.clear();
  return blocks;
}

void SeenPatches::set(Key key, const SeenPatch& patch) {
  const Key block = block_of(key);
  const auto at = patches_.find(key);
  const bool is_new = at == patches_.end();
  before_.emplace_back(key, is_new ? std::nullopt : std::optional(at->second));
  changed_.insert(block);
  patches_[key] = patch;
  if (is_new) blocks_[block].push_back(key);
}

void SeenPatches::roll_back() noexcept {
  for (auto change = before_.rbegin(); change != before_.rend(); ++change) {
    const auto& [key, before] = *change;
    const auto at = patches_.find(key);
    if (at == patches_.end()) continue;  // the change that failed
    if (before) {
      at.value() = *before;
      continue;
    }
    patches_.erase(at);
    const auto block = blocks_.find(block_of(key));
    if (block == blocks_.end()) continue;
    std::erase(block.value(), key);
    if (block->second.empty()) blocks_.erase(block);
  }
  before_.clear();
}

}  // namespace octosurf::alignment
