#include "occupancy/occupancy_map.hpp"

#include "occupancy/batch_insert.hpp"
#include "occupancy/grazing.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <array>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

VoxelPoint point_of(const VoxelNode& node, const VoxelGrid& grid, VoxelKey key) {
  return {key,
          load_point(node.payload, grid, key),
          decode_view(node.payload.view),
          static_cast<std::uint8_t>(node.payload.range_class),
          node.payload.surface,
          const_cast<VoxelNode*>(&node)};
}

VoxelKey child_key(VoxelKey key, unsigned child, int level) {
  return {static_cast<std::uint16_t>(key.x | (child & 1) << level),
          static_cast<std::uint16_t>(key.y | (child >> 1 & 1) << level),
          static_cast<std::uint16_t>(key.z | (child >> 2 & 1) << level)};
}

/// Calls visit(node, key) for every point below `node`, which spans 2^level voxels from `key`.
template <class Visit>
void visit_points(const VoxelTree& tree, const VoxelNode* node, VoxelKey key, int level, const Visit& visit) {
  if (level == 0) {
    if (node->payload.has_point()) visit(*node, key);
    return;
  }
  if (!tree.nodeHasChildren(node)) return;
  for (unsigned c = 0; c < 8; ++c)
    if (tree.nodeChildExists(node, c))
      visit_points(tree, tree.getNodeChild(node, c), child_key(key, c, level - 1), level - 1, visit);
}

/// The node that spans 2^level voxels around `key`, or the undivided leaf above it, or nullptr.
template <class Tree>
auto find_node(Tree& tree, VoxelKey key, int level, int* found_level = nullptr) -> decltype(tree.getRoot()) {
  auto* node = tree.getRoot();
  for (int l = 15; node != nullptr && l >= level; --l) {
    const unsigned child = (key.x >> l & 1) | (key.y >> l & 1) << 1 | (key.z >> l & 1) << 2;
    if (!tree.nodeHasChildren(node)) {
      if (found_level != nullptr) *found_level = l + 1;
      return node;
    }
    node = tree.nodeChildExists(node, child) ? tree.getNodeChild(node, child) : nullptr;
  }
  if (found_level != nullptr) *found_level = level;
  return node;
}

}  // namespace

/// Keeps the points while BatchInsert walks, and says which misses do not count.
struct OccupancyMap::Policy {
  const VoxelTree& tree;
  const VoxelGrid& grid;
  const VoxelScan& scan;
  const Downsampler& index;
  const PlaneLookup* planes;
  GrazingTest grazing;
  OccupancyDelta delta;

  bool keep(const VoxelNode& leaf, VoxelKey key) {
    if (planes == nullptr || leaf.payload.surface == 0) return false;
    Plane plane;
    double tolerance = 0;
    return planes->find(leaf.payload.surface, plane, tolerance) && !grazing.crosses(key, plane, tolerance);
  }

  void changed(VoxelNode& leaf, VoxelKey key, bool hit, bool was_occupied) {
    const bool occupied = tree.isNodeOccupied(leaf);
    if (hit && occupied) {
      store(leaf, key);
    } else if (was_occupied && !occupied && leaf.payload.has_point()) {
      delta.vanished.push_back(point_of(leaf, grid, key));
      delta.vanished.back().node = nullptr;
      leaf.payload = {};
    }
  }

 private:
  void store(VoxelNode& leaf, VoxelKey key) {
    const Eigen::Vector3f& centroid = scan.ends[static_cast<std::size_t>(index.find(key))].centroid;
    if (!leaf.payload.has_point()) {
      store_point(leaf.payload, grid, key, centroid, scan.origin);
      delta.appeared.push_back(point_of(leaf, grid, key));
    } else if (range_class_of((scan.origin - centroid).norm()) < leaf.payload.range_class) {
      // A view from clearly nearer is worth more than the first one.
      const VoxelPoint before = point_of(leaf, grid, key);
      store_point(leaf.payload, grid, key, centroid, scan.origin);
      delta.refined.push_back({before, point_of(leaf, grid, key)});
    }
  }
};

OccupancyMap::OccupancyMap(const OccupancyParameters& parameters)
    : grid_(parameters.resolution), tree_(std::make_unique<VoxelTree>(parameters.resolution)), bits_(grid_) {
  tree_->setProbHit(parameters.hit);
  tree_->setProbMiss(parameters.miss);
  tree_->setClampingThresMin(parameters.clamp_min);
  tree_->setClampingThresMax(parameters.clamp_max);
  tree_->setOccupancyThres(parameters.occupied);
}
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;
OccupancyMap::~OccupancyMap() = default;

OccupancyDelta OccupancyMap::insert(const VoxelScan& scan, const Downsampler& index,
                                    const PlaneLookup* planes) {
  const std::span<const TouchedBlock> blocks = bits_.trace(scan);
  if (blocks.empty()) return {};
  const bool fresh = tree_->mutable_root() == nullptr;
  Policy policy{*tree_, grid_, scan, index, planes, GrazingTest(scan, grid_), {}};
  BatchInsert<VoxelTree, Policy> insert_blocks(*tree_, policy);
  insert_blocks(tree_->make_root(), fresh, blocks);
  return std::move(policy.delta);
}

OccupancyMap::Lookup OccupancyMap::at(VoxelKey key) const {
  int level = 0;
  const VoxelNode* node = find_node(*tree_, key, 0, &level);
  if (node == nullptr) return {};
  Lookup found{tree_->isNodeOccupied(node) ? State::occupied : State::free, node->getLogOdds(), {}};
  if (level == 0 && node->payload.has_point()) found.point = point_of(*node, grid_, key);
  return found;
}

void OccupancyMap::assign(const VoxelPoint& point, SurfaceId surface) {
  point.node->payload.surface = surface & 0xffffff;
}

void OccupancyMap::assign(VoxelKey key, SurfaceId surface) {
  int level = 0;
  VoxelNode* node = find_node(*tree_, key, 0, &level);
  if (node != nullptr && level == 0 && node->payload.has_point()) node->payload.surface = surface & 0xffffff;
}

void OccupancyMap::read_block(VoxelKey key, std::vector<VoxelPoint>& out) const {
  const VoxelKey base{static_cast<std::uint16_t>(key.x & ~7), static_cast<std::uint16_t>(key.y & ~7),
                      static_cast<std::uint16_t>(key.z & ~7)};
  int level = 0;
  const VoxelNode* node = find_node(*tree_, base, 3, &level);
  if (node == nullptr || level != 3) return;
  visit_points(*tree_, node, base, 3,
               [&](const VoxelNode& leaf, VoxelKey k) { out.push_back(point_of(leaf, grid_, k)); });
}

void OccupancyMap::for_each_point(const std::function<void(const VoxelPoint&)>& visit) const {
  if (tree_->getRoot() == nullptr) return;
  visit_points(*tree_, tree_->getRoot(), {}, 16,
               [&](const VoxelNode& leaf, VoxelKey k) { visit(point_of(leaf, grid_, k)); });
}

std::vector<VoxelPoint> OccupancyMap::adopt_occupied_voxels() {
  // What borders on the unknown only, the underside of a floor say, nobody can have seen; unless the
  // map knows nothing free at all.
  bool knows_free = false;
  for (auto leaf = tree_->begin_leafs(); leaf != tree_->end_leafs() && !knows_free; ++leaf)
    knows_free = !tree_->isNodeOccupied(*leaf);
  const State open = knows_free ? State::free : State::unknown;
  constexpr std::int64_t largest_skin = std::int64_t{1} << 27;  // voxels; a hostile file claims 2³²
  std::int64_t skin = 0;
  // Collected first: dividing leaves while iterating would invalidate the iterator.
  std::vector<VoxelKey> border;
  constexpr std::array<std::array<int, 3>, 6> steps{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  const auto neighbour = [](VoxelKey k, const std::array<int, 3>& s) {
    return VoxelKey{static_cast<std::uint16_t>(k.x + s[0]), static_cast<std::uint16_t>(k.y + s[1]),
                    static_cast<std::uint16_t>(k.z + s[2])};
  };
  for (auto leaf = tree_->begin_leafs(); leaf != tree_->end_leafs(); ++leaf) {
    if (!tree_->isNodeOccupied(*leaf) || leaf->payload.has_point()) continue;
    const int edge = 1 << (16 - leaf.getDepth());
    const octomap::OcTreeKey first = leaf.getIndexKey();
    skin += 6 * std::int64_t{edge} * edge;
    if (skin > largest_skin)
      throw Error(Error::Kind::data, "octree", "its undivided occupied blocks have too large a surface",
                  "no scan leaves such blocks; map the place anew");
    const auto rim = [edge](int v) { return v == 0 || v == edge - 1; };
    for (int z = 0; z < edge; ++z)
      for (int y = 0; y < edge; ++y)
        // Inside a block only the two ends of a row are on its skin.
        for (int x = 0; x < edge; x += rim(z) || rim(y) || edge == 1 ? 1 : edge - 1) {
          const VoxelKey k = neighbour({first[0], first[1], first[2]}, {x, y, z});
          for (const auto& s : steps)
            if (at(neighbour(k, s)).state == open) {
              border.push_back(k);
              break;
            }
        }
  }
  std::vector<VoxelPoint> adopted;
  for (const VoxelKey k : border) {
    Eigen::Vector3f free = Eigen::Vector3f::Zero(), unknown = free, first_free = free, first_unknown = free;
    for (const auto& s : steps) {
      const State state = at(neighbour(k, s)).state;
      const Eigen::Vector3f v(static_cast<float>(s[0]), static_cast<float>(s[1]), static_cast<float>(s[2]));
      if (state == State::free) free += v;
      if (state == State::unknown) unknown += v;
      if (state == State::free && first_free.isZero()) first_free = v;
      if (state == State::unknown && first_unknown.isZero()) first_unknown = v;
    }
    // A wall one voxel thick is open on both sides: one of them has to do.
    const Eigen::Vector3f view = !free.isZero()         ? free
                                 : !first_free.isZero() ? first_free
                                 : !unknown.isZero()    ? unknown
                                                        : first_unknown;
    int level = 0;
    VoxelNode* node = find_node(*tree_, k, 0, &level);
    for (; level > 0; node = find_node(*tree_, k, 0, &level)) tree_->expandNode(node);
    const Eigen::Vector3f centre = grid_.centre_of(k);
    store_point(node->payload, grid_, k, centre, centre + view);
    adopted.push_back(point_of(*node, grid_, k));
  }
  return adopted;
}

OccupancyMap::Size OccupancyMap::size() const {
  Size size;
  size.nodes = tree_->size();
  size.leaves = tree_->getNumLeafNodes();
  // Heap blocks as glibc hands them out: 24-byte nodes take 32, arrays of eight children 80.
  size.bytes = size.nodes * 32 + (size.nodes - size.leaves) * 80;
  return size;
}

}  // namespace octosurf
