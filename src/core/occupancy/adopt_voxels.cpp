// Creates points for octrees without any, as from OctoMap files.
#include "geometry/voxel_key.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <optional>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::occupancy {
namespace {

using geometry::VoxelKey;

using State = OccupancyMap::State;

bool is_free(const OccupancyMap& map, VoxelKey key) { return map.at(key).state == State::free; }

/// Determines from which side occupied voxels were seen. The ray of a reading that ends behind a surface
/// frees voxels there: pockets of free space from which nothing was seen. Around a sensor everything is free,
/// and its rays connect that space with what it saw. Open is free space that is face-connected with an
/// aligned cube of 4³ free voxels; rays of outliers, few and a voxel wide, do not fill such a cube. In a map
/// without one all free space is open, and in a map without free space unknown space is. Results are cached:
/// free space must not change meanwhile.
class OpenSpace {
 public:
  OpenSpace(const OccupancyMap& map, const VoxelTree& tree);
  /// O(1) amortised: visits only as much of a component as is needed to decide.
  bool contains(VoxelKey key);

 private:
  static constexpr int cube_edge = 4;  // voxels

  bool in_free_cube(VoxelKey key);
  bool is_connected(VoxelKey key);

  const OccupancyMap& map_;
  enum class Rule { connected, free, unknown } rule_;
  tsl::robin_map<std::uint64_t, bool, geometry::PackedKeyHash> cubes_;  ///< whether all free
  tsl::robin_map<std::uint64_t, bool, geometry::PackedKeyHash> open_;   ///< free voxels outside such cubes
};

OpenSpace::OpenSpace(const OccupancyMap& map, const VoxelTree& tree) : map_(map), rule_(Rule::unknown) {
  tree.visit_leaves([&](const VoxelTree::Node& leaf, VoxelKey corner) {
    if (rule_ == Rule::connected || tree.occupied(leaf.log_odds())) return;
    rule_ = in_free_cube(corner) ? Rule::connected : Rule::free;
  });
}

bool OpenSpace::in_free_cube(VoxelKey key) {
  const auto down = [](std::uint16_t v) { return static_cast<std::uint16_t>(v / cube_edge * cube_edge); };
  const VoxelKey corner{down(key.x), down(key.y), down(key.z)};
  const auto [entry, is_new] = cubes_.try_emplace(corner.packed(), true);
  for (int i = 0; is_new && i < cube_edge * cube_edge * cube_edge; ++i)
    if (!is_free(map_,
                 stepped(corner, {i % cube_edge, i / cube_edge % cube_edge, i / cube_edge / cube_edge}))) {
      entry.value() = false;
      break;
    }
  return entry->second;
}

bool OpenSpace::contains(VoxelKey key) {
  if (rule_ == Rule::unknown) return map_.at(key).state == State::unknown;
  return is_free(map_, key) && (rule_ == Rule::free || is_connected(key));
}

bool OpenSpace::is_connected(VoxelKey key) {
  if (in_free_cube(key)) return true;
  const auto [seed, is_new] = open_.try_emplace(key.packed(), false);
  if (!is_new) return seed->second;
  std::vector<VoxelKey> component{key};
  bool open = false;
  for (std::size_t i = 0; i < component.size() && !open; ++i)
    for (const geometry::VoxelStep& step : geometry::face_steps) {
      const VoxelKey next = stepped(component[i], step);
      if (!is_free(map_, next)) continue;
      if (in_free_cube(next)) {
        open = true;
        break;
      }
      const auto [entry, unvisited] = open_.try_emplace(next.packed(), false);
      if (unvisited)
        component.push_back(next);
      else if (entry->second)  // otherwise a pocket would be visited completely
        open = true;
    }
  if (open)
    for (const VoxelKey k : component) open_[k.packed()] = true;
  return open;
}

std::int64_t cube(std::int64_t edge) { return edge * edge * edge; }

/// Calls visit(key) for the voxels on the surface of a cube.
template <class Visit>
void visit_skin(VoxelKey corner, int edge, const Visit& visit) {
  const auto boundary = [edge](int v) { return v == 0 || v == edge - 1; };
  for (int z = 0; z < edge; ++z)
    for (int y = 0; y < edge; ++y)
      // Inside a block only the two ends of a row are on its surface.
      for (int x = 0; x < edge; x += boundary(z) || boundary(y) || edge == 1 ? 1 : edge - 1)
        visit(stepped(corner, {x, y, z}));
}

/// Toward the open neighbours. A wall one voxel thick is open on both sides: one of them is chosen. Zero, if
/// none is open.
Eigen::Vector3f open_side(OpenSpace& open, VoxelKey key) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero(), first = sum;
  for (const geometry::VoxelStep& s : geometry::face_steps) {
    if (!open.contains(stepped(key, s))) continue;
    const Eigen::Vector3f v(static_cast<float>(s[0]), static_cast<float>(s[1]), static_cast<float>(s[2]));
    sum += v;
    if (first.isZero()) first = v;
  }
  return sum.isZero() ? first : sum;
}

/// A point for a voxel without one.
struct Adopted {
  VoxelKey key;
  Eigen::Vector3f position, side;
};

/// Readings scatter about a surface, so voxels in front of it and behind it are occupied. The surface is
/// assumed in the middle of the occupied voxels along the line of sight. A stack deeper than noise
/// (OpenSpace: 4 voxels; along an axis √3 times as deep) is a solid body, with the surface at its first
/// voxel; one that is open on both sides is a plate with two surfaces.
constexpr int deepest_stack = 6;

/// Voxels from `key` inwards, itself included; none if that is no stack.
std::optional<int> depth_of_stack(const OccupancyMap& map, OpenSpace& open, VoxelKey key,
                                  const geometry::VoxelStep& inwards) {
  for (int depth = 1; depth <= deepest_stack; ++depth) {
    key = stepped(key, inwards);
    if (map.at(key).state == OccupancyMap::State::occupied) continue;
    return open.contains(key) ? std::nullopt : std::optional(depth);
  }
  return {};
}

/// The middle of the stack that begins with a voxel open to this side, along the axis where it is shallowest.
/// None if the stack has a point.
std::optional<Adopted> middle_of_stack(const OccupancyMap& map, OpenSpace& open, VoxelKey key,
                                       const Eigen::Vector3f& side) {
  int depth = deepest_stack + 1;
  geometry::VoxelStep inwards{};
  for (int axis = 0; axis < 3; ++axis) {
    if (side[axis] == 0) continue;
    geometry::VoxelStep step{};
    step[static_cast<std::size_t>(axis)] = side[axis] > 0 ? -1 : 1;
    const std::optional<int> of_axis = depth_of_stack(map, open, key, step);
    if (of_axis.value_or(depth) >= depth) continue;
    depth = *of_axis;
    inwards = step;
  }
  if (depth > deepest_stack) return Adopted{key, map.grid().centre_of(key), side};
  VoxelKey middle = key;
  for (int i = 0; i < depth; ++i) {
    if (map.at(key).point) return {};
    key = stepped(key, inwards);
    if (i < (depth - 1) / 2) middle = key;
  }
  Eigen::Vector3f position = map.grid().centre_of(middle);
  if (depth % 2 == 0)  // between two voxels, still in the first
    position += (0.5F - 1.0F / 512) * static_cast<float>(map.grid().resolution()) *
                Eigen::Vector3i(inwards.data()).cast<float>();
  return Adopted{middle, position, side};
}

}  // namespace

std::vector<VoxelPoint> OccupancyMap::adopt_occupied_voxels() {
  // Scanned buildings have up to a voxel on such surfaces for 70 bytes of their octree.
  const std::int64_t largest_skin =
      (std::int64_t{1} << 17) + static_cast<std::int64_t>(tree_->bytes() / 32);  // voxels
  std::int64_t skin = 0;
  // Collected first: leaves must not be divided during the visit.
  std::vector<Adopted> border;
  tsl::robin_set<std::uint64_t, geometry::PackedKeyHash> taken;
  OpenSpace open(*this, *tree_);
  tree_->visit_leaves([&](const VoxelTree::Node& leaf, VoxelKey corner) {
    if (!tree_->occupied(leaf.log_odds()) || leaf.payload() != nullptr) return;
    const int edge = 1 << leaf.level();
    if (edge > 1) skin += cube(edge) - cube(edge - 2);
    if (skin > largest_skin)
      throw Error(Error::Kind::data, "octree", "its undivided occupied blocks have too large a surface",
                  "no scan leaves such blocks; map the place anew, or leave of solid bodies only their skin");
    visit_skin(corner, edge, [&](VoxelKey k) {
      const Eigen::Vector3f side = open_side(open, k);
      if (side.isZero()) return;
      if (const auto point = middle_of_stack(*this, open, k, side);
          point && taken.insert(point->key.packed()).second)
        border.push_back(*point);
    });
  });
  std::vector<VoxelPoint> adopted;
  for (const auto& [k, position, side] : border) {
    store_point(tree_->make_payload(k), grid_, k, position, position + side);
    adopted.push_back(*at(k).point);
  }
  return adopted;
}

}  // namespace octosurf::occupancy
