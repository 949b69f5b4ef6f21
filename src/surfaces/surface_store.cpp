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
  index_normal(id, plane);
  return models_.try_emplace(id, id, plane, origin, resolution_).first->second;
}

SurfaceModel& SurfaceStore::restore(const SurfaceModel::State& state) {
  SurfaceModel& model = models_.try_emplace(state.id, state, resolution_).first->second;
  index_normal(state.id, state.plane);
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
  unindex_normal(id, found->second.plane());
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

void SurfaceStore::index_normal(SurfaceId id, const Plane& plane) {
  normals_[normal_bucket(plane.normal)].push_back(id);
}
void SurfaceStore::unindex_normal(SurfaceId id, const Plane& plane) {
  auto& ids = normals_[normal_bucket(plane.normal)];
  ids.erase(std::find(ids.begin(), ids.end(), id));
}

void SurfaceStore::set_plane(SurfaceModel& surface, const Plane& plane) {
  unindex_normal(surface.id(), surface.plane());
  surface.set_plane(plane);
  index_normal(surface.id(), plane);
}

std::vector<SurfaceId> SurfaceStore::near_plane(const Plane& plane, double angle_rad, double distance,
                                                const Eigen::Vector3d& point) const {
  std::vector<SurfaceId> ids;
  const double cos_angle = std::cos(angle_rad);
  const double spread = 2 * std::sin(std::min(angle_rad, 3.0) / 2);  // chord: largest change of a component
  const auto low = [&](int a) { return normal_cell(std::max(-1.0, plane.normal[a] - spread)); };
  const auto high = [&](int a) { return normal_cell(std::min(1.0, plane.normal[a] + spread)); };
  for (int z = low(2); z <= high(2); ++z)
    for (int y = low(1); y <= high(1); ++y)
      for (int x = low(0); x <= high(0); ++x) {
        const auto bucket = normals_.find((z * 11 + y) * 11 + x);
        if (bucket == normals_.end()) continue;
        for (const SurfaceId id : bucket->second) {
          const Plane& other = find(id)->plane();
          if (other.normal.dot(plane.normal) >= cos_angle &&
              std::fabs(other.signed_distance(point)) <= distance)
            ids.push_back(id);
        }
      }
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
