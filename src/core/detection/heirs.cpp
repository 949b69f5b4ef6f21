#include "detection/heirs.hpp"

#include <algorithm>

namespace octosurf::detection {

Heirs::Heirs(const Readings& readings, const Segmentation& segmentation) {
  const auto count = [&](SurfaceId before, Label label, double number) {
    if (label != clutter) readings_[label] += number;
    if (before == 0) return;
    Shares& shares = of_[before];
    shares.all += number;
    if (label != clutter) shares.with[label] += number;
  };
  for (Readings::Index i = 0; i < readings.size(); ++i) count(readings[i].surface, segmentation.labels[i], 1);
  for (const Outside& outside : segmentation.outside)
    count(outside.surface, outside.label, outside.sums.readings);
}

std::vector<SurfaceId> Heirs::surfaces() const {
  std::vector<SurfaceId> ids;
  for (const auto& [id, shares] : of_) ids.push_back(id);
  return ids;
}

std::map<Label, double>::const_iterator Heirs::most(const Shares& shares) const {
  return std::max_element(shares.with.begin(), shares.with.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
}

Label Heirs::of(SurfaceId before) const {
  const Shares& shares = of_.at(before);
  return shares.with.empty() ? clutter : most(shares)->first;
}

bool Heirs::keeps_most_readings(SurfaceId before) const {
  const Shares& shares = of_.at(before);
  return !shares.with.empty() &&
         shares.all - most(shares)->second <= sensing::ReadingModel::outlier_share * shares.all;
}

std::vector<SurfaceId> Heirs::keepers(std::size_t labels, const std::set<SurfaceId>& unpublished) const {
  std::vector<SurfaceId> keepers(labels, 0);
  std::vector<std::pair<bool, double>> most_readings(labels, {false, 0});
  for (const auto& [id, shares] : of_) {
    if (shares.with.empty()) continue;
    const auto& [label, shared] = *most(shares);
    const std::pair claim(!unpublished.contains(id), shared);
    if (claim <= most_readings[label]) continue;
    most_readings[label] = claim;
    keepers[label] = id;
  }
  return keepers;
}

std::vector<SurfaceId> Heirs::origins(std::size_t labels) const {
  std::vector<SurfaceId> origins(labels, 0);
  for (const auto& [id, shares] : of_)
    for (const auto& [label, shared] : shares.with)
      if (2 * shared > readings_.at(label)) origins[label] = id;
  return origins;
}

}  // namespace octosurf::detection
