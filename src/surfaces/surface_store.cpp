#include "surfaces/surface_store.hpp"

#include <algorithm>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf {

SurfaceStore SurfaceStore::beside(const SurfaceStore& known) {
  SurfaceStore store(known.resolution_);
  store.known_ = &known;
  store.next_id_ = known.next_id_;
  return store;
}

SurfaceModel& SurfaceStore::create(const Plane& plane, const Eigen::Vector3d& origin) {
  if (ids_left() == 0)
    throw Error(Error::Kind::data, "surface ids", "all 2^24 are used up", "start a new map");
  const SurfaceId id = next_id_++;
  return models_.try_emplace(id, id, plane, origin, resolution_).first->second;
}

SurfaceModel& SurfaceStore::restore(const SurfaceModel::State& state) {
  SurfaceModel& model = models_.try_emplace(state.id, state, resolution_).first->second;
  for (const Inlier& inlier : state.inliers) {
    auto& residents = places_[block_of(inlier.key)];
    const auto found =
        std::find_if(residents.begin(), residents.end(), [&](const Resident& r) { return r.id == state.id; });
    found == residents.end() ? residents.push_back({state.id, 1}) : void(++found->inliers);
  }
  return model;
}

void SurfaceStore::erase(SurfaceId id, SurfaceId into) {
  const auto found = models_.find(id);
  const SurfaceModel& model = found->second;
  departures_.push_back({Departure::Of::surface, id, into, model.born, 0, model.parents()});
  models_.erase(found);
}

SurfaceModel* SurfaceStore::find(SurfaceId id) {
  const auto found = models_.find(id);
  return found == models_.end() ? nullptr : &found->second;
}
const SurfaceModel* SurfaceStore::find(SurfaceId id) const {
  if (const auto found = models_.find(id); found != models_.end()) return &found->second;
  return known_ != nullptr ? known_->find(id) : nullptr;
}

void SurfaceStore::add(SurfaceModel& surface, const Inlier& inlier) {
  surface.add(inlier);
  auto& residents = places_[block_of(inlier.key)];
  for (Resident& resident : residents)
    if (resident.id == surface.id()) {
      ++resident.inliers;
      return;
    }
  residents.push_back({surface.id(), 1});
}

bool SurfaceStore::remove(SurfaceModel& surface, VoxelKey key, const Eigen::Vector3f& position) {
  if (!surface.remove(key, position)) return false;
  const auto place = places_.find(block_of(key));
  auto& residents = place.value();
  const auto found = std::find_if(residents.begin(), residents.end(),
                                  [&](const Resident& r) { return r.id == surface.id(); });
  if (--found->inliers == 0) residents.erase(found);
  if (residents.empty()) places_.erase(place);
  return true;
}

void SurfaceStore::add_ids_near(VoxelKey key, int reach, Ids& ids) const {
  const auto block = [](int k) { return static_cast<std::uint64_t>(std::clamp(k, 0, 65535) >> 3); };
  for (std::uint64_t z = block(key.z - reach); z <= block(key.z + reach); ++z)
    for (std::uint64_t y = block(key.y - reach); y <= block(key.y + reach); ++y)
      for (std::uint64_t x = block(key.x - reach); x <= block(key.x + reach); ++x) {
        const auto place = places_.find(z << 32 | y << 16 | x);
        if (place == places_.end()) continue;
        for (const Resident& resident : place->second)
          if (std::find(ids.begin(), ids.end(), resident.id) == ids.end()) ids.push_back(resident.id);
      }
}

SurfaceStore::Ids SurfaceStore::near(VoxelKey key, int reach) const {
  Ids ids;
  add_ids_near(key, reach, ids);
  if (known_ != nullptr) known_->add_ids_near(key, reach, ids);
  std::sort(ids.begin(), ids.end());
  return ids;
}

bool SurfaceStore::find(SurfaceId id, Plane& plane, double& tolerance) const {
  const SurfaceModel* surface = find(id);
  if (surface == nullptr) return false;
  plane = surface->plane();
  tolerance = erosion_tolerance_;
  return true;
}

}  // namespace octosurf
