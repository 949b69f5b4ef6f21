#include "detection/region_growing.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf {

RegionGrowing::RegionGrowing(Workspace& work, const Parameters& parameters, const RefusalSink* refusals)
    : work_(work),
      fewest_(static_cast<std::size_t>(parameters.min_surface_points())),
      cos_smooth_(static_cast<float>(std::cos(parameters.detection.smoothness_angle))),
      refusals_(refusals) {}

bool RegionGrowing::visit(Index i) {
  if (i >= visited_.size()) visited_.resize(std::max<std::size_t>(work_.window.size(), i + 1), false);
  if (visited_[i]) return false;
  visited_[i] = true;
  return true;
}

void RegionGrowing::sort_seeds(std::vector<Index>& seeds) {
  std::erase_if(seeds, [&](Index i) {
    const LocalPlane& plane = work_.normals.at(i);
    return !plane.known || !plane.flat;
  });
  // Flattest first; the key decides between equals, so that the points' order never does.
  std::sort(seeds.begin(), seeds.end(), [&](Index a, Index b) {
    const float ca = work_.normals.at(a).curvature, cb = work_.normals.at(b).curvature;
    return ca != cb ? ca < cb : work_.window[a].key < work_.window[b].key;
  });
}

}  // namespace octosurf
