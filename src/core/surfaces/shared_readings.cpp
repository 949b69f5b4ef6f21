#include "surfaces/shared_readings.hpp"

#include <algorithm>
#include <utility>

namespace octosurf::surfaces {

SharedReadings::Id SharedReadings::Shares::most() const {
  const auto most = std::max_element(with.begin(), with.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == with.end() ? 0 : most->first;
}

double SharedReadings::Shares::shared(Id id) const {
  const auto found = with.find(id);
  return found == with.end() ? 0 : found->second;
}

void SharedReadings::add(Id before, Id after, double readings) {
  if (after != 0) after_[after] += readings;
  if (before == 0) return;
  Shares& shares = before_[before];
  shares.all += readings;
  if (after != 0) shares.with[after] += readings;
}

double SharedReadings::after(Id id) const {
  const auto found = after_.find(id);
  return found == after_.end() ? 0 : found->second;
}

std::map<SharedReadings::Id, SharedReadings::Id> SharedReadings::keepers(
    const std::set<Id>& unpublished) const {
  std::map<Id, std::pair<bool, double>> most;
  std::map<Id, Id> keepers;
  for (const auto& [id, shares] : before_) {
    const Id successor = shares.most();
    const std::pair claim(!unpublished.contains(id), shares.shared(successor));
    if (successor == 0 || claim <= most[successor]) continue;
    most[successor] = claim;
    keepers[successor] = id;
  }
  return keepers;
}

std::map<SharedReadings::Id, SharedReadings::Id> SharedReadings::origins() const {
  std::map<Id, Id> origins;
  for (const auto& [id, shares] : before_)
    for (const auto& [successor, readings] : shares.with)
      if (2 * readings > after(successor)) origins[successor] = id;
  return origins;
}

}  // namespace octosurf::surfaces
