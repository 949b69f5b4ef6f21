#include "sensing/fingerprint.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

/// Of those in order of id; null if it is not there.
template <class Pointers, class Id>
auto find_in(const Pointers& all, Id id) {
  const auto at = std::lower_bound(all.begin(), all.end(), id,
                                   [](const auto& one, Id wanted) { return one->id < wanted; });
  return at != all.end() && (*at)->id == id ? at->get() : nullptr;
}

}  // namespace

const Surface* Snapshot::find(SurfaceId id) const { return find_in(surfaces, id); }
const Cylinder* Snapshot::find_cylinder(CylinderId id) const { return find_in(cylinders, id); }

std::vector<SurfacePtr> Snapshot::changed_since(std::uint64_t since) const {
  std::vector<SurfacePtr> changed;
  std::copy_if(surfaces.begin(), surfaces.end(), std::back_inserter(changed),
               [since](const SurfacePtr& s) { return s->revision > since; });
  return changed;
}

double Surface::normal_std_rad() const {
  const Eigen::Matrix2d slopes = covariance.topLeftCorner<2, 2>();  // its larger eigenvalue:
  return std::sqrt(
      std::max(0.0, slopes.trace() / 2 + std::hypot((slopes(0, 0) - slopes(1, 1)) / 2, slopes(0, 1))));
}

void surfaces::MapState::restore() {
  if (!unrestored) return;
  surfaces.roll_back(occupancy, *snapshot.latest());
  cylinders.roll_back();
  unrestored = false;
}

void surfaces::MapState::require_whole() const {
  if (!unrestored) return;
  throw Error(Error::Kind::incomplete, "map", "memory did not suffice to take back a scan that failed",
              "free some and call the mapper's map()");
}

struct surfaces::MapAccess {
  static Map map_of(std::unique_ptr<MapState> state) { return Map(std::move(state)); }
  static MapState& state_of(const Map& map) { return *map.state_; }
};

surfaces::MapState& surfaces::state_of(Map& map) {
  MapState& state = MapAccess::state_of(map);
  state.restore();
  return state;
}
const surfaces::MapState& surfaces::state_of(const Map& map) {
  const MapState& state = MapAccess::state_of(map);
  state.require_whole();
  return state;
}
Map surfaces::map_of(std::unique_ptr<MapState> state) { return MapAccess::map_of(std::move(state)); }

Map::Map(std::unique_ptr<surfaces::MapState> state) : state_(std::move(state)) {}
Map::Map(const Parameters& parameters) {
  parameters.validate();
  state_ = std::make_unique<surfaces::MapState>(parameters);
}
Map::Map(Map&&) noexcept = default;
Map& Map::operator=(Map&&) noexcept = default;
Map::~Map() = default;

const Parameters& Map::parameters() const { return state_->parameters; }

std::shared_ptr<const Snapshot> Map::snapshot() const { return state_->snapshot.read(); }

OccupancyView Map::octree() const {
  state_->require_whole();
  return state_->occupancy.share();
}

bool Map::holds(const Scan& scan) const {
  const std::vector<std::uint64_t>& held = surfaces::state_of(*this).held;
  return std::find(held.begin(), held.end(), sensing::fingerprint_of(scan)) != held.end();
}

OccupancyView::Voxel Map::at(const Eigen::Vector3d& point) const {
  const occupancy::OccupancyMap& occupancy = surfaces::state_of(*this).occupancy;
  geometry::VoxelKey key;  // by float, as points are mapped
  if (!occupancy.grid().key_of(point.cast<float>(), key)) return {};
  return occupancy.now().at(occupancy.grid().centre_of(key).cast<double>());
}

void Map::for_each_point(const std::function<void(const OccupancyView::Voxel&)>& visit) const {
  const auto all = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  surfaces::state_of(*this).occupancy.now().for_each_occupied({-all, all}, [&](const auto& voxel) {
    if (voxel.range_m > 0) visit(voxel);  // a reading's; not one that an octree without readings brought
    return true;
  });
}

Map::Size Map::size() const {
  const surfaces::MapState& map = surfaces::state_of(*this);
  const occupancy::OccupancyMap::Size octree = map.occupancy.size();
  Size size;
  size.nodes = octree.nodes;
  size.leaves = octree.leaves;
  size.bytes = octree.bytes;
  size.points = map.points;
  size.surfaces = map.surfaces.size();
  for (const auto& [id, surface] : map.surfaces) size.inliers += surface.size();
  size.pending = size.points - size.inliers;
  size.scans = map.scans;
  size.revision = map.revision;
  return size;
}

Eigen::Vector3d Map::origin() const { return state_->origin; }

void Map::set_origin(const Eigen::Vector3d& origin) {
  if (!origin.allFinite()) throw Error(Error::Kind::usage, "origin", "is not finite");
  state_->origin = origin;
}

Map map_from_octomap(const std::filesystem::path& file, Parameters parameters) {
  parameters.occupancy.resolution = read_octomap_resolution(file);
  parameters.validate();
  auto state = std::make_unique<surfaces::MapState>(parameters);
  state->occupancy = occupancy::OccupancyMap::read_octomap(file, parameters.occupancy);
  return surfaces::map_of(std::move(state));
}

Map map_from_leaves(std::span<const OccupancyView::Leaf> leaves, const Parameters& parameters) {
  parameters.validate();
  auto state = std::make_unique<surfaces::MapState>(parameters);
  state->occupancy.set_leaves(leaves);
  return surfaces::map_of(std::move(state));
}

}  // namespace octosurf
