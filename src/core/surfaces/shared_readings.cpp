#include "surfaces/shared_readings.hpp"

#include <algorithm>
#include <set>
#include <tuple>
#include <vector>

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

std::map<SharedReadings::Id, SharedReadings::Id> SharedReadings::pairs() const {
  std::vector<std::tuple<double, Id, Id>> candidates;  // minus readings, before, after
  for (const auto& [before, shares] : before_)
    for (const auto& [id, readings] : shares.with)
      if (2 * readings >= std::min(shares.all, after(id))) candidates.emplace_back(-readings, before, id);
  std::sort(candidates.begin(), candidates.end());
  std::map<Id, Id> pairs;
  std::set<Id> taken;
  for (const auto& [readings, before, after] : candidates)
    if (!pairs.contains(after) && taken.insert(before).second) pairs[after] = before;
  return pairs;
}

}  // namespace octosurf::surfaces
