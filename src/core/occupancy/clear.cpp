// Clears a region of the octree.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <octosurf/space_part.hpp>

namespace octosurf::occupancy {
namespace {

struct Clearing {
  const geometry::VoxelGrid& grid;
  const SpacePart& part;
  std::vector<VoxelPoint> vanished_points;

  VoxelTree::Meets meets(geometry::VoxelKey corner, int level) const {
    // Of the middles of its voxels, which decide.
    const double half = (std::ldexp(grid.resolution(), level) - grid.resolution()) / 2;
    const Eigen::Vector3d middle =
        grid.corner_of(corner) + Eigen::Vector3d::Constant(half + grid.resolution() / 2);
    const double distance = part.distance(middle), reach = half * std::numbers::sqrt3;
    return distance > reach     ? VoxelTree::Meets::nothing
           : distance <= -reach ? VoxelTree::Meets::all
                                : VoxelTree::Meets::some;
  }
  void vanished(const VoxelPayload& payload, geometry::VoxelKey key) {
    vanished_points.push_back(point_of(payload, grid, key));
  }
};

}  // namespace

OccupancyDelta OccupancyMap::clear(const SpacePart& part, bool as_free) {
  Clearing clearing{grid_, part, {}};
  tree_->clear(as_free ? std::optional(tree_->model().miss) : std::nullopt, clearing);
  OccupancyDelta delta;
  delta.vanished = std::move(clearing.vanished_points);
  return delta;
}

template <class Policy>
void VoxelTree::clear(Slot& slot, int level, std::uint64_t morton, std::optional<float> becomes,
                      Policy& policy) {
  if (slot.link == unknown) return;
  const Meets meets = policy.meets(key_of(morton << (3 * level)), level);
  if (meets == Meets::nothing) return;
  if (slot.link == leaf && meets == Meets::all) {
    slot = becomes ? Slot{leaf, *becomes} : Slot{};
    return;
  }
  if (level == brick_level) return clear_brick(slot, morton, becomes, policy);
  Group& children = divided(slot);
  for (unsigned c = 0; c < 8; ++c) clear(children[c], level - 1, morton << 3 | c, becomes, policy);
  if (std::all_of(children.begin(), children.end(), [](const Slot& child) { return child.link == unknown; }))
    forget(slot, level);
  else
    close(slot);
}

template <class Policy>
void VoxelTree::clear_brick(Slot& slot, std::uint64_t brick_morton, std::optional<float> becomes,
                            Policy& policy) {
  Brick& b = brick_at(slot);
  std::uint64_t inside = 0;
  for (std::uint64_t m = b.known; m != 0; m &= m - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(m));
    if (policy.meets(key_of(brick_morton << 6 | i), 0) == Meets::nothing) continue;
    inside |= std::uint64_t{1} << i;
    b.value[i] = becomes.value_or(-std::numeric_limits<float>::infinity());
  }
  if ((inside & b.points) != 0) drop_vanished(b, brick_morton, inside & b.points, policy);
  if (!becomes) {
    b.known &= ~inside;
    for (std::uint64_t m = inside; m != 0; m &= m - 1)
      b.value[static_cast<unsigned>(std::countr_zero(m))] = 0;
  }
  if (b.known == 0)
    forget(slot, brick_level);
  else
    close_brick(slot);
}

}  // namespace octosurf::occupancy

namespace octosurf {

SpacePart SpacePart::box(const Eigen::AlignedBox3d& box) {
  SpacePart part;
  part.T_map_part.translation() = box.center();
  part.half_size = box.sizes() / 2;
  return part;
}

SpacePart SpacePart::cylinder(const Eigen::Vector3d& base, double radius, double height,
                              const Eigen::Vector3d& axis) {
  SpacePart part;
  part.T_map_part.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis).toRotationMatrix();
  part.T_map_part.translation() = base + height / 2 * axis;
  part.half_size = {radius, radius, height / 2};
  part.round = true;
  return part;
}

double SpacePart::distance(const Eigen::Vector3d& point) const {
  const Eigen::Array3d p =
      (T_map_part.linear().transpose() * (point - T_map_part.translation())).array().abs();
  if (!round) return (p - half_size.array()).maxCoeff();
  return std::max(std::hypot(p.x(), p.y()) - half_size.x(), p.z() - half_size.z());
}

}  // namespace octosurf
