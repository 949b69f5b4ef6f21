#include "surfaces/surface_store.hpp"

#include <algorithm>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::surfaces {

SurfaceModel& SurfaceStore::create(const Plane& plane, const Eigen::Vector3d& origin) {
  if (ids_left() == 0)
    throw Error(Error::Kind::data, "surface ids", "all 2^24 are used up", "start a new map");
  SurfaceModel& model =
      models_.try_emplace(next_id_, next_id_, plane, origin, resolution_, file_).first->second;
  ++next_id_;
  model.kept_in = period_;
  return model;
}

SurfaceModel& SurfaceStore::restore(const SurfaceModel::State& state) {
  SurfaceModel& model = models_.try_emplace(state.id, state, resolution_, file_).first->second;
  for (const Inlier& inlier : state.inliers) add_resident(places_, inlier.key, state.id);
  return model;
}

void SurfaceStore::erase(SurfaceId id, SurfaceId into) {
  const auto found = models_.find(id);
  const SurfaceModel& model = kept(found->second);
  removals_.push_back({Removal::Of::surface, id, into, model.born, 0, model.parents()});
  models_.erase(found);
}

SurfaceModel* SurfaceStore::find(SurfaceId id) {
  const auto found = models_.find(id);
  return found == models_.end() ? nullptr : &kept(found->second);
}
const SurfaceModel* SurfaceStore::find(SurfaceId id) const {
  const auto found = models_.find(id);
  return found == models_.end() ? nullptr : &found->second;
}

void SurfaceStore::add(SurfaceModel& surface, const Inlier& inlier) {
  surface.add(inlier);
  add_resident(places_, inlier.key, surface.id());
}

bool SurfaceStore::count_in(Residents& residents, std::uint64_t place, SurfaceId id) {
  auto& there = residents.try_emplace(place, residents.get_allocator().file).first.value();
  const auto found = std::find_if(there.begin(), there.end(), [&](const Resident& r) { return r.id == id; });
  if (found != there.end()) {
    ++found->count;
    return false;
  }
  there.push_back({id, 1});
  return true;
}

bool SurfaceStore::count_out(Residents& residents, std::uint64_t place, SurfaceId id) {
  const auto at = residents.find(place);
  auto& there = at.value();
  const auto found = std::find_if(there.begin(), there.end(), [&](const Resident& r) { return r.id == id; });
  if (--found->count > 0) return false;
  there.erase(found);
  if (there.empty()) residents.erase(at);
  return true;
}

void SurfaceStore::add_resident(Places& places, geometry::VoxelKey key, SurfaceId id) {
  if (count_in(places.blocks, block_of(key), id)) count_in(places.regions, region_of(key), id);
}

bool SurfaceStore::remove(SurfaceModel& surface, geometry::VoxelKey key, const Eigen::Vector3f& position) {
  if (!surface.remove(key, position)) return false;
  if (count_out(places_.blocks, block_of(key), surface.id()))
    count_out(places_.regions, region_of(key), surface.id());
  return true;
}

void SurfaceStore::add_ids_near(const Residents& residents, int bits, geometry::VoxelKey key, int reach,
                                Ids& ids) {
  const auto place = [bits](int k) { return static_cast<std::uint64_t>(std::clamp(k, 0, 65535) >> bits); };
  for (std::uint64_t z = place(key.z - reach); z <= place(key.z + reach); ++z)
    for (std::uint64_t y = place(key.y - reach); y <= place(key.y + reach); ++y)
      for (std::uint64_t x = place(key.x - reach); x <= place(key.x + reach); ++x) {
        const auto there = residents.find(z << 32 | y << 16 | x);
        if (there == residents.end()) continue;
        for (const Resident& resident : there->second)
          if (std::find(ids.begin(), ids.end(), resident.id) == ids.end()) ids.push_back(resident.id);
      }
}

SurfaceStore::Ids SurfaceStore::near(geometry::VoxelKey key, int reach) const {
  Ids ids;
  add_ids_near(places_.blocks, block_bits, key, reach, ids);
  std::sort(ids.begin(), ids.end());
  return ids;
}

SurfaceStore::Ids SurfaceStore::in_regions_near(geometry::VoxelKey key, int reach) const {
  Ids ids;
  add_ids_near(places_.regions, region_bits, key, reach, ids);
  std::sort(ids.begin(), ids.end());
  return ids;
}

void SurfaceStore::begin_changes() {
  ++period_;
  open_ = true;
  next_id_before_ = next_id_;
}

/// Call before the model is changed.
SurfaceModel& SurfaceStore::kept(SurfaceModel& model) {
  if (open_ && model.kept_in != period_) {
    heads_before_.push_back(model.head());
    model.kept_in = period_;
  }
  return model;
}

void SurfaceStore::commit() noexcept {
  open_ = false;
  heads_before_.clear();
}

void SurfaceStore::roll_back(const occupancy::OccupancyMap& points, const Snapshot& published) {
  std::map<SurfaceId, SurfaceModel::State> before;
  for (const SurfaceModel::State& head : heads_before_) before.emplace(head.id, head);
  for (auto& [id, state] : before)
    if (const Surface* surface = published.find(id)) state.polygons = surface->polygons;
  if (!before.empty())
    points.for_each_point([&](const occupancy::VoxelPoint& p) {
      if (const auto found = before.find(p.surface); found != before.end())
        found->second.inliers.push_back({p.key, p.range_class, p.position});
    });
  std::map<SurfaceId, SurfaceModel> models;
  for (auto& [id, state] : before) {
    std::sort(state.inliers.begin(), state.inliers.end(),
              [](const Inlier& a, const Inlier& b) { return a.key < b.key; });
    models.try_emplace(id, state, resolution_, file_);
  }
  Places places(file_);
  const auto settle = [&](SurfaceId id, const SurfaceModel& model) {
    model.for_each_inlier([&](const Inlier& inlier) { add_resident(places, inlier.key, id); });
  };
  for (const auto& [id, model] : models) settle(id, model);
  for (const auto& [id, model] : models_)
    if (id < next_id_before_ && !models.contains(id)) settle(id, model);

  // From here on nothing can fail.
  models_.erase(models_.lower_bound(next_id_before_), models_.end());
  for (const auto& [id, state] : before) models_.erase(id);
  models_.merge(models);
  std::swap(places_, places);
  next_id_ = next_id_before_;
  removals_.clear();
  commit();
}

bool SurfaceStore::find(SurfaceId id, Plane& plane, double& tolerance) const {
  const SurfaceModel* surface = find(id);
  if (surface == nullptr) return false;
  plane = surface->plane();
  tolerance = erosion_tolerance_;
  return true;
}

}  // namespace octosurf::surfaces
