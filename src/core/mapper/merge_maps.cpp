#include "mapper/merge_maps.hpp"

#include "alignment/alignment_state.hpp"
#include "surfaces/shared_readings.hpp"

#include <string>

#include <octosurf/error.hpp>

namespace octosurf::mapper {
namespace {

void require_same(const char* parameter, double ours, double theirs, const char* hint) {
  if (ours == theirs) return;
  throw Error(Error::Kind::data, "the other map",
              std::string("its ") + parameter + " is " + std::to_string(theirs) + ", here it is " +
                  std::to_string(ours),
              hint);
}

}  // namespace

void require_mergeable(const surfaces::MapState& map, const surfaces::MapState& other,
                       const Eigen::Isometry3d& T_map_other) {
  if (&map == &other)
    throw Error(Error::Kind::usage, "the other map", "is the map itself, whose readings would count twice",
                "give another one");
  require_rigid(T_map_other, "T_map_other");
  const OccupancyParameters &ours = map.parameters.occupancy, &theirs = other.parameters.occupancy;
  constexpr const char* hint = "build one of them anew with the other's parameters";
  require_same("resolution", ours.resolution, theirs.resolution, hint);
  // The weights of hits and misses may differ, as they are already in the log-odds. These parameters define
  // what log-odds mean.
  require_same("clamp_min", ours.clamp_min, theirs.clamp_min, hint);
  require_same("clamp_max", ours.clamp_max, theirs.clamp_max, hint);
  require_same("occupied", ours.occupied, theirs.occupied, hint);
}

OtherMap::OtherMap(const surfaces::MapState& other, const Eigen::Isometry3d& T_map_other,
                   const OccupancyParameters& parameters)
    : other_(other), T_map_other_(T_map_other) {
  if (T_map_other.matrix() == Eigen::Matrix4d::Identity()) return;
  resampled_.emplace(occupancy::OccupancyMap::resampled(other.occupancy, T_map_other, parameters, lost_));
}

void OtherMap::hand_over_records(surfaces::MapState& map) const {
  map.scans += other_.scans;
  map.held.insert(map.held.end(), other_.held.begin(), other_.held.end());
  map.sensors_up += T_map_other_.linear() * other_.sensors_up;
  for (alignment::AlignmentState::Misfit misfit : alignment::record_of(other_).state.misfits) {
    misfit.position = T_map_other_ * misfit.position;
    alignment::record_of(map).state.note_misfit(misfit);
  }
  map.noise.add(other_.noise);
}

std::vector<MergedSurface> OtherMap::successors_in(const surfaces::MapState& map) const {
  std::vector<MergedSurface> all;
  for (const auto& [id, surface] : other_.surfaces) {
    surfaces::SharedReadings shared;
    surface.for_each_inlier([&, own = id](const surfaces::Inlier& inlier) {
      geometry::VoxelKey key = inlier.key;
      if (resampled_ &&
          !map.occupancy.grid().key_of((T_map_other_ * inlier.position.cast<double>()).cast<float>(), key))
        return;
      if (const auto found = map.occupancy.at(key).point; found && found->surface != 0)
        shared.add(own, found->surface);
    });
    MergedSurface& merged = all.emplace_back(MergedSurface{.other = id, .inliers = surface.size()});
    for (const auto& [own, shares] : shared.before()) {
      merged.id = shares.most();
      merged.shared = static_cast<std::size_t>(shares.shared(merged.id));
      merged.on_surfaces = static_cast<std::size_t>(shares.all);
    }
  }
  return all;
}

}  // namespace octosurf::mapper
