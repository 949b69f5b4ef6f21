#include "detection/junctions.hpp"

#include "detection/constants.hpp"

#include <algorithm>
#include <iterator>

namespace octosurf::detection {

Junctions::Junctions(const Readings& readings, const std::vector<Label>& labels,
                     const std::vector<Patch>& patches)
    : readings_(&readings), of_(readings.size_with_context()), ambiguous_(readings.size_with_context()) {
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const Label own = labels[i];
    if (own == clutter) continue;
    const std::span<const Index> near = readings.near(i);
    if (std::any_of(near.begin(), near.end(),
                    [&](Index j) { return labels[j] != own && labels[j] != clutter; }))
      contacts_.push_back(i);
  }
  renew(labels, patches);
}

void Junctions::renew(const std::vector<Label>& labels, const std::vector<Patch>& patches) {
  planes_.clear();
  for (const Patch& patch : patches) planes_.push_back(patch.plane);
  beside_.clear();
  for (const Index i : contacts_) find_beside(i, labels);
}

void Junctions::find_beside(Index i, const std::vector<Label>& labels) {
  of_[i] = {.first = static_cast<std::uint32_t>(beside_.size()), .count = 0};
  ambiguous_[i] = false;
  if (labels[i] == clutter) return;
  const Eigen::Vector3d& normal = planes_[labels[i]].normal;
  for (const Index j : readings_->near(i)) {
    const Label label = labels[j];
    if (label == clutter || label == labels[i]) continue;
    const double cosine = normal.dot(planes_[label].normal);
    if (cosine >= Constants::cos_nearly_parallel) continue;
    const auto own = std::next(beside_.begin(), of_[i].first);
    if (std::find(own, beside_.end(), label) != beside_.end()) continue;
    if (!readings_->is_context(i) && readings_->gain(i, planes_[label]) > 0) ambiguous_[i] = true;
    if (cosine > -Constants::cos_nearly_parallel)
      beside_.push_back(label);  // the back of a board separates nothing
  }
  of_[i].count = static_cast<std::uint32_t>(beside_.size()) - of_[i].first;
}

bool Junctions::passes_beside(Index beside, Index i, Index j) const {
  const Beside& own = of_[beside];
  for (std::uint32_t k = own.first; k < own.first + own.count; ++k) {
    const Plane& plane = planes_[beside_[k]];
    if ((*readings_)[i].distance(plane) * (*readings_)[j].distance(plane) < 0) return true;
  }
  return false;
}

}  // namespace octosurf::detection
