#include "surfaces/cylinder_store.hpp"

#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::surfaces {

CylinderPtr CylinderModel::publish(std::uint64_t map_revision) const {
  std::vector<geometry::CylinderSample> points;
  points.reserve(inliers.size());
  double squares = 0;
  for (const auto& [key, inlier] : inliers) {
    points.push_back({inlier.position.cast<double>(), 1});
    squares += std::pow(shape.distance(points.back().position), 2);
  }
  const geometry::CylinderExtent extent = geometry::extent_of(shape, points);
  auto cylinder = std::make_shared<Cylinder>();
  cylinder->id = id;
  cylinder->axis_point = shape.point + (extent.low + extent.high) / 2 * shape.axis;
  cylinder->axis = shape.axis;
  cylinder->radius_m = shape.radius;
  cylinder->length_m = extent.length();
  cylinder->start = extent.start;
  cylinder->span_rad = extent.span;
  cylinder->inliers = points.size();
  cylinder->rms_m = std::sqrt(squares / static_cast<double>(points.size()));
  cylinder->born = born;
  cylinder->revision = map_revision;
  return cylinder;
}

CylinderModel& CylinderStore::create(const geometry::CylinderShape& shape) {
  const CylinderId id = free_id(next_id_);
  CylinderModel& cylinder = models_[id];
  cylinder.id = id;
  next_id_ = id + 1;
  cylinder.shape = shape;
  touched_.insert(cylinder.id);
  return cylinder;
}

CylinderId CylinderStore::free_id(CylinderId first) {
  if (first > last_id) throw Error(Error::Kind::data, "cylinder ids", "none is left", "start a new map");
  return first;
}

CylinderModel& CylinderStore::restore(CylinderModel model) {
  for (const auto& [key, inlier] : model.inliers) owners_[key.packed()] = model.id;
  return models_.insert_or_assign(model.id, std::move(model)).first->second;
}

void CylinderStore::erase(CylinderId id, CylinderId into) {
  const auto found = models_.find(id);
  kept(id, found->second);
  removals_.push_back({Removal::Of::cylinder, id, into, found->second.born, 0, {}});
  for (const auto& [key, inlier] : found->second.inliers) owners_.erase(key.packed());
  models_.erase(found);
  touched_.erase(id);
}

void CylinderStore::add(CylinderModel& cylinder, const Inlier& inlier) {
  kept(cylinder.id, cylinder);
  release(inlier.key);
  cylinder.inliers[inlier.key] = inlier;
  owners_[inlier.key.packed()] = cylinder.id;
  ++cylinder.unchecked;
  touched_.insert(cylinder.id);
}

void CylinderStore::release(geometry::VoxelKey key) {
  if (owners_.empty()) return;
  const auto owner = owners_.find(key.packed());
  if (owner == owners_.end()) return;
  CylinderModel& cylinder = models_.at(owner->second);
  kept(cylinder.id, cylinder);
  cylinder.inliers.erase(key);
  ++cylinder.unchecked;
  touched_.insert(cylinder.id);
  owners_.erase(owner);
}

void CylinderStore::move(const Inlier& inlier) {
  const CylinderId id = owner(inlier.key);
  if (id == 0) return;
  CylinderModel& cylinder = models_.at(id);
  kept(cylinder.id, cylinder);
  cylinder.inliers[inlier.key] = inlier;
  ++cylinder.unchecked;
  touched_.insert(id);
}

std::vector<CylinderPtr> CylinderStore::publish(std::uint64_t map_revision) {
  for (const CylinderId id : touched_) {
    CylinderModel& cylinder = models_.at(id);
    kept(cylinder.id, cylinder);
    if (cylinder.revision == 0) cylinder.born = map_revision;
    cylinder.revision = map_revision;
    cylinder.published = cylinder.publish(map_revision);
  }
  touched_.clear();
  std::vector<CylinderPtr> all;
  all.reserve(models_.size());
  for (auto& [id, cylinder] : models_) {
    if (!cylinder.published) cylinder.published = cylinder.publish(cylinder.revision);
    all.push_back(cylinder.published);
  }
  return all;
}

void CylinderStore::begin_changes() {
  touched_before_ = touched_;
  open();
}

void CylinderStore::commit() noexcept {
  close();
  touched_before_.clear();
}

void CylinderStore::roll_back() {
  decltype(owners_) owners;
  const auto settle = [&](const CylinderModel& model) {
    for (const auto& [key, inlier] : model.inliers) owners[key.packed()] = model.id;
  };
  for (const auto& [id, model] : before_) settle(model);
  for (const auto& [id, model] : models_)
    if (id < next_id_before_ && !before_.contains(id)) settle(model);

  // From here on nothing can fail.
  owners_.swap(owners);
  touched_.swap(touched_before_);
  put_back(before_);
  touched_before_.clear();
}

}  // namespace octosurf::surfaces
