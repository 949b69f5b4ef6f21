#include "io/exporters/page_changes.hpp"

#include "io/exporters/page_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

template <typename Id, typename Heir>
Json no_more(const std::vector<Id>& gone, const std::vector<Heir>& merged) {
  Json ids = gone;
  for (const Heir& heir : merged) ids.push_back(heir.before);
  return ids;
}

void add_track(PageBlock& block, const SensorTrack& track) {
  if (!track.sensor) return;
  constexpr double step_m = 1e-3, farthest_m = 1e6;
  Json pose = Json::array();
  const Eigen::Matrix4d& matrix = track.T_map_sensor.matrix();
  for (Eigen::Index row = 0; row < 4; ++row)
    for (Eigen::Index column = 0; column < 4; ++column) pose.push_back(matrix(row, column));
  block.json["sensor"] = {{"kind", *track.sensor == SensorKind::lidar ? "lidar" : "depth_camera"},
                          {"pose", std::move(pose)},
                          {"step_m", step_m}};
  for (const int axis : {0, 1, 2}) {
    std::vector<std::int32_t> steps;
    for (const Eigen::Vector3d& place : track.places)
      steps.push_back(
          static_cast<std::int32_t>(std::lround(std::clamp(place[axis], -farthest_m, farthest_m) / step_m)));
    block.add(std::string("track_") + "xyz"[axis], differences(steps));
  }
}

/// The part of the snapshot to send.
Snapshot told_of(const Snapshot& snapshot, std::uint64_t since) {
  Snapshot told = snapshot;
  told.surfaces = snapshot.changed_since(since);
  std::erase_if(told.cylinders, [&](const CylinderPtr& cylinder) { return cylinder->revision <= since; });
  return told;
}

}  // namespace

void SensorTrack::add(SensorKind kind, const Eigen::Isometry3d& pose) {
  sensor = kind;
  T_map_sensor = pose;
  const auto far_enough = [this](const Eigen::Vector3d& place) {
    return places.empty() || (place - places.back()).norm() >= step_m;
  };
  if (far_enough(pose.translation())) places.push_back(pose.translation());
  while (places.size() > most_places) {
    step_m *= 2;
    std::vector<Eigen::Vector3d> all;
    std::swap(all, places);
    for (const Eigen::Vector3d& place : all)
      if (far_enough(place)) places.push_back(place);
  }
}

std::string page_changes_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run,
                                 const SensorTrack& track) {
  const Snapshot& snapshot = *map.snapshot;
  const auto* changes = std::get_if<MapChanges>(&map.changes);
  PageBlock block;
  block.json["kind"] = "changes";
  block.json["run"] = run;
  block.json["name"] = map.name;
  block.json["revision"] = snapshot.revision;
  block.json["resolution"] = snapshot.resolution;
  block.json["since"] = changes != nullptr ? Json(changes->since) : Json();
  add_up(block, up);
  add_track(block, track);
  PageMap told{map.name, map.snapshot};
  told.stairs = map.stairs;
  if (changes != nullptr) {
    block.json["gone"] = no_more(changes->gone, changes->merged);
    block.json["cylinders_gone"] = no_more(changes->cylinders_gone, changes->cylinders_merged);
    told.snapshot = std::make_shared<const Snapshot>(told_of(snapshot, changes->since));
  }
  add_surfaces(block, told, changes != nullptr ? changes->since : 0);
  return block.packed();
}

std::string page_voxels_message(const PageMap& map, const Eigen::Vector3d& up, bool slices,
                                std::size_t most_bytes) {
  const std::vector<PageVoxel> voxels = occupied_voxels(map.octree);
  std::string message;
  for (const int merged : {1, 2, 4, 8, 16, 32}) {
    PageBlock block;
    block.json["kind"] = "voxels";
    block.json["revision"] = map.snapshot->revision;
    block.json["merged"] = merged;
    block.json["voxels_before_merging"] = voxels.size();
    Json ids = Json::array();  // ids by number, as used in voxel_surface
    for (const SurfacePtr& surface : map.snapshot->surfaces) ids.push_back(surface->id);
    block.json["surface_ids"] = std::move(ids);
    add_up(block, up);
    const std::vector<PageVoxel> drawn = merged > 1 ? merge_voxels(voxels, merged) : voxels;
    const double size = map.octree.resolution() * merged;
    add_voxels(block, drawn, size, *map.snapshot);
    if (slices) add_slices(block, map.octree, drawn, size, up);
    message = block.packed();
    if (message.size() <= most_bytes) break;
  }
  return message;
}

}  // namespace octosurf::io
