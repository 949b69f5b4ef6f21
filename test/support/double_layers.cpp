#include "support/double_layers.hpp"

#include <cmath>
#include <map>
#include <utility>

namespace octosurf::test {
namespace {

using surfaces::Inlier;
using surfaces::SurfaceModel;
constexpr double same_way = 0.9659258262890683;  // cos 15°
constexpr double farthest_of_layer = 0.05;       // m: farther apart are two things
constexpr double much = 0.2;                     // of the smaller one

}  // namespace

std::vector<DoubleLayer> double_layers(const surfaces::SurfaceStore& surfaces) {
  std::vector<DoubleLayer> layers;
  for (const auto& [id, one] : surfaces) {
    const int reach = static_cast<int>(std::ceil(farthest_of_layer / one.resolution()));
    std::map<SurfaceId, DoubleLayer> over;
    for (const Inlier& inlier : one.sorted_inliers())
      for (const SurfaceId other_id : surfaces.near(inlier.key, reach)) {
        const SurfaceModel& other = *surfaces.find(other_id);
        if (std::pair(other.size(), other_id) <= std::pair(one.size(), id) ||
            other.plane().normal.dot(one.plane().normal) < same_way)
          continue;
        const double distance = std::fabs(other.plane().signed_distance(inlier.position.cast<double>()));
        if (distance > farthest_of_layer || !other.covers(other.cell_of(inlier.position))) continue;
        DoubleLayer& layer = over.try_emplace(other_id, DoubleLayer{id, other_id}).first->second;
        ++layer.inliers;
        layer.distance_m += distance;
      }
    for (auto& [other_id, layer] : over) {
      layer.distance_m /= static_cast<double>(layer.inliers);
      if (static_cast<double>(layer.inliers) >= much * static_cast<double>(one.size()))
        layers.push_back(layer);
    }
  }
  return layers;
}

}  // namespace octosurf::test
