#include "law/junctions.hpp"

#include <algorithm>
#include <iterator>

namespace octosurf::law {

Junctions::Junctions(const Readings& readings, const std::vector<Label>& labels,
                     const std::vector<Patch>& patches)
    : readings_(readings), ambiguous_(readings.size_with_context(), false) {
  for (const Patch& patch : patches) planes_.push_back(patch.plane);
  first_.reserve(readings.size_with_context() + 1);
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    first_.push_back(beside_.size());
    if (labels[i] == clutter) continue;
    const Eigen::Vector3d& normal = planes_[labels[i]].normal;
    for (const Index j : readings.near(i)) {
      const Label label = labels[j];
      if (label == clutter || label == labels[i]) continue;
      const double cosine = normal.dot(planes_[label].normal);
      if (cosine >= cos_nearly_parallel) continue;
      const auto own = std::next(beside_.begin(), static_cast<std::ptrdiff_t>(first_.back()));
      if (std::find(own, beside_.end(), label) != beside_.end()) continue;
      if (!readings.is_context(i) && readings.gain(i, planes_[label]) > 0) ambiguous_[i] = true;
      if (cosine > -cos_nearly_parallel) beside_.push_back(label);  // the back of a board parts nothing
    }
  }
  first_.push_back(beside_.size());
}

bool Junctions::passes_beside(Index beside, Index i, Index j) const {
  for (std::size_t k = first_[beside]; k < first_[beside + 1]; ++k) {
    const Plane& plane = planes_[beside_[k]];
    if (readings_[i].distance(plane) * readings_[j].distance(plane) < 0) return true;
  }
  return false;
}

}  // namespace octosurf::law
