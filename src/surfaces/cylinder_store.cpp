#include "surfaces/cylinder_store.hpp"

#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf {

std::vector<CylinderSample> CylinderModel::samples(const NoiseModel& noise, std::size_t stride) const {
  std::vector<CylinderSample> samples;
  samples.reserve(inliers.size() / stride + 1);
  std::size_t k = 0;
  for (const auto& [key, inlier] : inliers)
    if (k++ % stride == 0)
      samples.push_back({inlier.position.cast<double>(), Eigen::Vector3d::Zero(),
                         std::max(noise.sigma(inlier.range_class), 1e-6)});
  return samples;
}

CylinderPtr CylinderModel::publish(std::uint64_t map_revision) const {
  std::vector<CylinderSample> points;
  points.reserve(inliers.size());
  double squares = 0;
  for (const auto& [key, inlier] : inliers) {
    points.push_back({inlier.position.cast<double>(), Eigen::Vector3d::Zero(), 1});
    squares += std::pow(shape.distance(points.back().position), 2);
  }
  const CylinderExtent extent = extent_of(shape, points);
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

CylinderModel& CylinderStore::create(const CylinderShape& shape) {
  if (ids_left() == 0)
    throw Error(Error::Kind::data, "cylinder ids", "all 2^32 are used up", "start a new map");
  const CylinderId id = next_id_++;
  CylinderModel& cylinder = models_[id];
  cylinder.id = id;
  cylinder.shape = shape;
  touched_.insert(id);
  return cylinder;
}

CylinderModel& CylinderStore::restore(CylinderModel model) {
  for (const auto& [key, inlier] : model.inliers) owners_[key.packed()] = model.id;
  return models_.insert_or_assign(model.id, std::move(model)).first->second;
}

void CylinderStore::erase(CylinderId id, CylinderId into) {
  const auto found = models_.find(id);
  departures_.push_back({Departure::Of::cylinder, id, into, found->second.born, 0, {}});
  for (const auto& [key, inlier] : found->second.inliers) owners_.erase(key.packed());
  models_.erase(found);
  touched_.erase(id);
}

CylinderModel* CylinderStore::find(CylinderId id) {
  const auto found = models_.find(id);
  return found == models_.end() ? nullptr : &found->second;
}
const CylinderModel* CylinderStore::find(CylinderId id) const {
  const auto found = models_.find(id);
  return found == models_.end() ? nullptr : &found->second;
}

void CylinderStore::add(CylinderModel& cylinder, const Inlier& inlier) {
  release(inlier.key);
  cylinder.inliers[inlier.key] = inlier;
  owners_[inlier.key.packed()] = cylinder.id;
  ++cylinder.unchecked;
  touched_.insert(cylinder.id);
}

void CylinderStore::release(VoxelKey key) {
  if (owners_.empty()) return;
  const auto owner = owners_.find(key.packed());
  if (owner == owners_.end()) return;
  CylinderModel& cylinder = models_.at(owner->second);
  cylinder.inliers.erase(key);
  ++cylinder.unchecked;
  touched_.insert(cylinder.id);
  owners_.erase(owner);
}

void CylinderStore::move(const Inlier& inlier) {
  const CylinderId id = owner(inlier.key);
  if (id == 0) return;
  CylinderModel& cylinder = models_.at(id);
  cylinder.inliers[inlier.key] = inlier;
  ++cylinder.unchecked;
  touched_.insert(id);
}

std::vector<CylinderPtr> CylinderStore::publish(std::uint64_t map_revision) {
  for (const CylinderId id : touched_) {
    CylinderModel& cylinder = models_.at(id);
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

}  // namespace octosurf
