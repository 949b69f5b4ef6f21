#include "occupancy/open_space.hpp"

#include <vector>

namespace octosurf::occupancy {
namespace {

using geometry::VoxelKey;
constexpr int cube_edge = 4;  // voxels

using State = OccupancyMap::State;

bool is_free(const OccupancyMap& map, VoxelKey key) { return map.at(key).state == State::free; }

}  // namespace

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

}  // namespace octosurf::occupancy
