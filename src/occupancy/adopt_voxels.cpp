// Points for octrees that come without: what OctoMap files hold.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <array>

#include <octosurf/error.hpp>

namespace octosurf::occupancy {
namespace {

using State = OccupancyMap::State;
using Step = std::array<int, 3>;
constexpr std::array<Step, 6> steps{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

geometry::VoxelKey neighbour(geometry::VoxelKey k, const Step& s) {
  return {static_cast<std::uint16_t>(k.x + s[0]), static_cast<std::uint16_t>(k.y + s[1]),
          static_cast<std::uint16_t>(k.z + s[2])};
}

bool knows_free(const VoxelTree& tree) {
  bool any = false;
  tree.visit_leaves(
      [&](const VoxelTree::Node& leaf, geometry::VoxelKey) { any = any || !tree.occupied(leaf.log_odds()); });
  return any;
}

std::int64_t cube(std::int64_t edge) { return edge * edge * edge; }

/// Calls visit(key) for the voxels on the skin of a cube.
template <class Visit>
void visit_skin(geometry::VoxelKey corner, int edge, const Visit& visit) {
  const auto rim = [edge](int v) { return v == 0 || v == edge - 1; };
  for (int z = 0; z < edge; ++z)
    for (int y = 0; y < edge; ++y)
      // Inside a block only the two ends of a row are on its skin.
      for (int x = 0; x < edge; x += rim(z) || rim(y) || edge == 1 ? 1 : edge - 1)
        visit(neighbour(corner, {x, y, z}));
}

/// Toward the free or, failing that, the unknown neighbours. A wall one voxel thick is open on both
/// sides: one of them has to do.
Eigen::Vector3f open_side(const OccupancyMap& map, geometry::VoxelKey key) {
  Eigen::Vector3f free = Eigen::Vector3f::Zero(), unknown = free, first_free = free, first_unknown = free;
  for (const Step& s : steps) {
    const State state = map.at(neighbour(key, s)).state;
    const Eigen::Vector3f v(static_cast<float>(s[0]), static_cast<float>(s[1]), static_cast<float>(s[2]));
    if (state == State::free) free += v;
    if (state == State::unknown) unknown += v;
    if (state == State::free && first_free.isZero()) first_free = v;
    if (state == State::unknown && first_unknown.isZero()) first_unknown = v;
  }
  return !free.isZero()         ? free
         : !first_free.isZero() ? first_free
         : !unknown.isZero()    ? unknown
                                : first_unknown;
}

}  // namespace

std::vector<VoxelPoint> OccupancyMap::adopt_occupied_voxels() {
  // What borders on the unknown only, the underside of a floor say, nobody can have seen; unless the
  // map knows nothing free at all.
  const State open = knows_free(*tree_) ? State::free : State::unknown;
  // Scanned buildings have up to a voxel on such skins for 70 bytes of their octree.
  const std::int64_t largest_skin =
      (std::int64_t{1} << 17) + static_cast<std::int64_t>(tree_->bytes() / 32);  // voxels
  std::int64_t skin = 0;
  // Collected first: a leaf must not be divided while leaves are visited.
  std::vector<geometry::VoxelKey> border;
  tree_->visit_leaves([&](const VoxelTree::Node& leaf, geometry::VoxelKey corner) {
    if (!tree_->occupied(leaf.log_odds()) || leaf.payload() != nullptr) return;
    const int edge = 1 << leaf.level();
    if (edge > 1) skin += cube(edge) - cube(edge - 2);
    if (skin > largest_skin)
      throw Error(Error::Kind::data, "octree", "its undivided occupied blocks have too large a surface",
                  "no scan leaves such blocks; map the place anew, or leave of solid bodies only their skin");
    visit_skin(corner, edge, [&](geometry::VoxelKey k) {
      for (const Step& s : steps)
        if (at(neighbour(k, s)).state == open) {
          border.push_back(k);
          break;
        }
    });
  });
  std::vector<VoxelPoint> adopted;
  for (const geometry::VoxelKey k : border) {
    const Eigen::Vector3f centre = grid_.centre_of(k);
    VoxelPayload& payload = tree_->make_payload(k);
    store_point(payload, grid_, k, centre, centre + open_side(*this, k));
    adopted.push_back({k,
                       load_point(payload, grid_, k),
                       sensing::decode_view(payload.view),
                       static_cast<std::uint8_t>(payload.range_class),
                       0,
                       {}});
  }
  return adopted;
}

}  // namespace octosurf::occupancy
