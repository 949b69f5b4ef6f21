// Points for octrees that come without: what OctoMap files hold.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/open_space.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <octosurf/error.hpp>

namespace octosurf::occupancy {
namespace {

using geometry::VoxelKey;

std::int64_t cube(std::int64_t edge) { return edge * edge * edge; }

/// Calls visit(key) for the voxels on the skin of a cube.
template <class Visit>
void visit_skin(VoxelKey corner, int edge, const Visit& visit) {
  const auto rim = [edge](int v) { return v == 0 || v == edge - 1; };
  for (int z = 0; z < edge; ++z)
    for (int y = 0; y < edge; ++y)
      // Inside a block only the two ends of a row are on its skin.
      for (int x = 0; x < edge; x += rim(z) || rim(y) || edge == 1 ? 1 : edge - 1)
        visit(stepped(corner, {x, y, z}));
}

/// Toward the open neighbours. A wall one voxel thick is open on both sides: one of them has to do. Zero, if
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

}  // namespace

std::vector<VoxelPoint> OccupancyMap::adopt_occupied_voxels() {
  // Scanned buildings have up to a voxel on such skins for 70 bytes of their octree.
  const std::int64_t largest_skin =
      (std::int64_t{1} << 17) + static_cast<std::int64_t>(tree_->bytes() / 32);  // voxels
  std::int64_t skin = 0;
  // Collected first: a leaf must not be divided while leaves are visited.
  std::vector<std::pair<VoxelKey, Eigen::Vector3f>> border;
  OpenSpace open(*this, *tree_);
  tree_->visit_leaves([&](const VoxelTree::Node& leaf, VoxelKey corner) {
    if (!tree_->occupied(leaf.log_odds()) || leaf.payload() != nullptr) return;
    const int edge = 1 << leaf.level();
    if (edge > 1) skin += cube(edge) - cube(edge - 2);
    if (skin > largest_skin)
      throw Error(Error::Kind::data, "octree", "its undivided occupied blocks have too large a surface",
                  "no scan leaves such blocks; map the place anew, or leave of solid bodies only their skin");
    visit_skin(corner, edge, [&](VoxelKey k) {
      if (const Eigen::Vector3f side = open_side(open, k); !side.isZero()) border.emplace_back(k, side);
    });
  });
  std::vector<VoxelPoint> adopted;
  for (const auto& [k, side] : border) {
    const Eigen::Vector3f centre = grid_.centre_of(k);
    VoxelPayload& payload = tree_->make_payload(k);
    store_point(payload, grid_, k, centre, centre + side);
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
