#include "occupancy/occupancy_map.hpp"

#include "occupancy/grazing.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/ray_tracer.hpp"
#include "occupancy/voxel_tree.hpp"

#include <array>
#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::occupancy {
namespace {

/// Lower limits of the classes' ranges, slightly raised, because the class itself decides.
const std::array<float, 16> nearest_of = [] {
  std::array<float, 16> ranges;
  for (unsigned c = 0; c < ranges.size(); ++c)
    ranges[c] = 1.001F * sensing::range_of_class(c) / std::exp2(0.25F);
  return ranges;
}();

/// In OctoMap's precision.
float log_odds_of(double probability) {
  return static_cast<float>(std::log(probability / (1 - probability)));
}

OccupancyModel model_of(const OccupancyParameters& p) {
  return {log_odds_of(p.hit), log_odds_of(p.miss), log_odds_of(p.clamp_min), log_odds_of(p.clamp_max),
          log_odds_of(p.occupied)};
}

}  // namespace

/// Updates the points during the tree's traversal, and decides which misses do not count.
struct OccupancyMap::Policy {
  const geometry::VoxelGrid& grid;
  const SurfaceNumbers& numbers;
  const sensing::VoxelScan& scan;
  const std::uint32_t* next_hit;  // the rest of TouchedVoxels::ends
  const PlaneLookup* planes;
  GrazingTest grazing;
  OccupancyDelta delta;

  bool keep(const VoxelPayload& payload, geometry::VoxelKey key) {
    if (planes == nullptr || payload.surface == 0) return false;
    Plane plane;
    double tolerance = 0;
    return planes->find(numbers.id(payload.surface), plane, tolerance) &&
           !grazing.crosses(key, plane, tolerance);
  }

  void vanished(const VoxelPayload& payload, geometry::VoxelKey key) {
    delta.vanished.push_back(point_of(payload, numbers, grid, key));
  }

  void hit(VoxelPayload& payload, geometry::VoxelKey key) {
    while (!(scan.ends[*next_hit].key == key)) ++next_hit;  // hits in voxels that are not occupied yet
    const std::uint32_t end = *next_hit++;
    const Eigen::Vector3f& centroid = scan.ends[end].centroid;
    const Eigen::Vector3f& seen_from = scan.start_of(scan.ends[end]);
    if (!payload.has_point()) {
      store_point(payload, grid, key, centroid, seen_from);
      delta.appeared.push_back(point_of(payload, numbers, grid, key));
    } else if (const float near = nearest_of[payload.range_class];
               (seen_from - centroid).squaredNorm() < near * near &&
               sensing::range_class_of((seen_from - centroid).norm()) < payload.range_class) {
      // A view from clearly nearer replaces the first one.
      const VoxelPoint before = point_of(payload, numbers, grid, key);
      store_point(payload, grid, key, centroid, seen_from);
      delta.refined.push_back({before, point_of(payload, numbers, grid, key)});
    } else if (payload.surface != 0) {
      delta.confirmed.push_back({numbers.id(payload.surface), end});
    }
  }
};

OccupancyMap::OccupancyMap(const OccupancyParameters& parameters)
    : grid_(parameters.resolution), tree_(std::make_unique<VoxelTree>(model_of(parameters))) {}
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;
OccupancyMap::~OccupancyMap() = default;

OccupancyDelta OccupancyMap::apply(const TouchedVoxels& touched, const sensing::VoxelScan& scan,
                                   const PlaneLookup* planes) {
  Policy policy{grid_, tree_->numbers, scan, touched.ends.data(), planes, GrazingTest(scan, grid_), {}};
  tree_->apply(touched.blocks, policy);
  return std::move(policy.delta);
}

OccupancyDelta OccupancyMap::insert(const sensing::VoxelScan& scan, const sensing::Downsampler& index,
                                    const PlaneLookup* planes, int threads) {
  return apply(RayTracer(grid_)(scan, index, threads), scan, planes);
}

bool OccupancyMap::empty() const { return tree_->empty(); }

OccupancyMap::Lookup OccupancyMap::at(geometry::VoxelKey key) const {
  const VoxelTree::Lookup found = tree_->find(key);
  if (!found.known) return {};
  Lookup lookup{tree_->occupied(found.log_odds) ? State::occupied : State::free, found.log_odds, {}};
  if (found.payload != nullptr) lookup.point = point_of(*found.payload, tree_->numbers, grid_, key);
  return lookup;
}

OccupancyMap::Lookup OccupancyMap::at(const Eigen::Vector3d& point) const {
  geometry::VoxelKey key;
  return grid_.key_of(point.cast<float>(), key) ? at(key) : Lookup{};
}

void OccupancyMap::begin_changes() { tree_->begin_changes(); }
void OccupancyMap::commit() noexcept { tree_->commit(); }
void OccupancyMap::roll_back() noexcept { tree_->roll_back(); }

OccupancyView OccupancyMap::share() { return {tree_->share(), grid_.resolution()}; }
OccupancyView OccupancyMap::now() const {
  return {std::shared_ptr<const VoxelTree>(std::shared_ptr<void>(), tree_.get()), grid_.resolution()};
}

void OccupancyMap::add_surface(SurfaceId id) { tree_->numbers.add(id); }
void OccupancyMap::remove_surface(SurfaceId id) { tree_->numbers.remove(id); }

void OccupancyMap::assign(const VoxelPoint& point, SurfaceId surface) {
  if (point.place.run.size_class == 0) return assign(point.key, surface);
  tree_->assign(point.key, point.place, surface);
}

void OccupancyMap::assign(geometry::VoxelKey key, SurfaceId surface) {
  const VoxelTree::Lookup found = tree_->find(key);
  if (found.payload != nullptr) tree_->assign(key, found.place, surface);
}

void OccupancyMap::read_block(geometry::VoxelKey key, std::vector<VoxelPoint>& out) const {
  tree_->visit_points(
      key, 3, [&](const VoxelPayload& payload, geometry::VoxelKey k, PayloadPlace place, float log_odds) {
        out.push_back(point_of(payload, tree_->numbers, grid_, k, place, log_odds));
      });
}

void OccupancyMap::for_each_point(const std::function<void(const VoxelPoint&)>& visit) const {
  tree_->visit_points({}, VoxelTree::top_level,
                      [&](const VoxelPayload& payload, geometry::VoxelKey k, PayloadPlace place, float) {
                        visit(point_of(payload, tree_->numbers, grid_, k, place));
                      });
}

namespace {

void count_nodes(const VoxelTree::Node& node, OccupancyMap::Size& size) {
  ++size.nodes;
  if (!node.has_children()) {
    ++size.leaves;
    return;
  }
  for (unsigned c = 0; c < 8; ++c)
    if (const VoxelTree::Node child = node.child(c); child.exists()) count_nodes(child, size);
}

}  // namespace

std::size_t OccupancyMap::bytes() const { return tree_->bytes(); }

OccupancyMap::Size OccupancyMap::size() const {
  Size size;
  if (!tree_->empty()) count_nodes(tree_->root(), size);
  size.bytes = tree_->bytes();
  return size;
}

}  // namespace octosurf::occupancy
