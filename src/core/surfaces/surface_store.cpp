#include "surfaces/surface_store.hpp"

#include <algorithm>

#include <octosurf/error.hpp>

namespace octosurf::surfaces {

SurfaceModel& SurfaceStore::create(const Plane& plane, const Eigen::Vector3d& origin) {
  const SurfaceId id = free_id(next_id_);
  numbers_.insert(occupancy::SurfaceNumbers::of(id));
  SurfaceModel& model = models_.try_emplace(id, id, plane, origin, resolution_).first->second;
  next_id_ = id + 1;
  return model;
}

SurfaceId SurfaceStore::free_id(SurfaceId first) const {
  const SurfaceId end = std::min(first + occupancy::SurfaceNumbers::count, last_id + 1);
  for (SurfaceId id = first; id < end; ++id)
    if (occupancy::SurfaceNumbers::of(id) != 0 && !has_number_of(id)) return id;
  throw Error(Error::Kind::data, "surface ids", "none is left", "start a new map");
}

SurfaceModel& SurfaceStore::restore(const SurfaceModel::State& state) {
  numbers_.insert(occupancy::SurfaceNumbers::of(state.id));
  SurfaceModel& model = models_.try_emplace(state.id, state, resolution_).first->second;
  for (const Inlier& inlier : state.inliers) places_.add(inlier.key, state.id);
  return model;
}

void SurfaceStore::erase(SurfaceId id, SurfaceId into) {
  const auto found = models_.find(id);
  const SurfaceModel& model = kept(id, found->second);
  removals_.push_back({Removal::Of::surface, id, into, model.born, 0, model.parents()});
  numbers_.erase(occupancy::SurfaceNumbers::of(id));
  models_.erase(found);
}

void SurfaceStore::add(SurfaceModel& surface, const Inlier& inlier) {
  surface.add(inlier);
  places_.add(inlier.key, surface.id());
}

bool SurfaceStore::remove(SurfaceModel& surface, geometry::VoxelKey key, const Eigen::Vector3f& position) {
  if (!surface.remove(key, position)) return false;
  if (places_.blocks.count_out(key, surface.id())) places_.regions.count_out(key, surface.id());
  return true;
}

bool SurfaceStore::Residents::count_in(geometry::VoxelKey key, SurfaceId id) {
  std::vector<Resident>& there = cubes_[cube_of(key)];
  const auto found = std::find_if(there.begin(), there.end(), [&](const Resident& r) { return r.id == id; });
  if (found != there.end()) {
    ++found->count;
    return false;
  }
  there.push_back({id, 1});
  return true;
}

bool SurfaceStore::Residents::count_out(geometry::VoxelKey key, SurfaceId id) {
  const auto at = cubes_.find(cube_of(key));
  std::vector<Resident>& there = at.value();
  const auto found = std::find_if(there.begin(), there.end(), [&](const Resident& r) { return r.id == id; });
  if (--found->count > 0) return false;
  there.erase(found);
  if (there.empty()) cubes_.erase(at);
  return true;
}

SurfaceStore::Ids SurfaceStore::Residents::near(geometry::VoxelKey key, int reach) const {
  Ids ids;
  const auto place = [this](int k) { return static_cast<std::uint64_t>(std::clamp(k, 0, 65535) >> bits_); };
  for (std::uint64_t z = place(key.z - reach); z <= place(key.z + reach); ++z)
    for (std::uint64_t y = place(key.y - reach); y <= place(key.y + reach); ++y)
      for (std::uint64_t x = place(key.x - reach); x <= place(key.x + reach); ++x) {
        const auto there = cubes_.find(z << 32 | y << 16 | x);
        if (there == cubes_.end()) continue;
        for (const Resident& resident : there->second)
          if (std::find(ids.begin(), ids.end(), resident.id) == ids.end()) ids.push_back(resident.id);
      }
  std::sort(ids.begin(), ids.end());
  return ids;
}

void SurfaceStore::roll_back(const occupancy::OccupancyMap& points, const Snapshot& published) {
  std::map<SurfaceId, SurfaceModel::State> before = before_;
  Places places;
  points.for_each_point([&](const occupancy::VoxelPoint& p) {
    if (p.surface != 0) places.add(p.key, p.surface);
    if (const auto found = before.find(p.surface); found != before.end())
      found->second.inliers.push_back({p.key, p.range_class, p.position});
  });
  std::map<SurfaceId, SurfaceModel> models;
  for (auto& [id, state] : before) {
    if (const Surface* surface = published.find(id)) state.polygons = surface->polygons;
    std::sort(state.inliers.begin(), state.inliers.end(),
              [](const Inlier& a, const Inlier& b) { return a.key < b.key; });
    models.try_emplace(id, state, resolution_);
  }

  tsl::robin_set<std::uint32_t> numbers;
  for (const auto* all : {&models_, &models})
    for (const auto& [id, model] : *all)
      if (id < next_id_before_) numbers.insert(occupancy::SurfaceNumbers::of(id));

  // From here on nothing can fail.
  std::swap(numbers_, numbers);
  std::swap(places_, places);
  put_back(models);
}

bool SurfaceStore::find(SurfaceId id, Plane& plane, double& tolerance) const {
  const SurfaceModel* surface = find(id);
  if (surface == nullptr) return false;
  plane = surface->plane();
  tolerance = erosion_tolerance_;
  return true;
}

}  // namespace octosurf::surfaces
