// Combines the octree with another one, or with a region of space: one walk for all.
#include "occupancy/key_box.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <octosurf/space_part.hpp>

namespace octosurf::occupancy {
namespace {

using LogOdds = std::optional<float>;  // none: unknown
using Node = VoxelTree::Node;

/// Another octree as operand, on the same grid.
struct OtherTree {
  using Cube = Node;  ///< or the larger leaf that holds it
  const VoxelTree& tree;
  const SurfaceNumbers& numbers;  ///< here
  const OccupancyModel& model;
  const geometry::VoxelGrid& grid;
  OccupancyDelta delta{};

  Cube root() const { return tree.root(); }
  static bool is_uniform(const Cube& cube) { return !cube.has_children(); }
  static Cube part(const Cube& cube, unsigned c) { return cube.has_children() ? cube.child(c) : cube; }
  static LogOdds at(const Cube& cube) { return cube.exists() ? LogOdds(cube.log_odds()) : LogOdds(); }
  static LogOdds at(const Cube& cube, unsigned voxel) {
    const VoxelTree::Brick* brick = cube.brick();
    if (brick == nullptr) return at(cube);
    return (brick->known >> voxel & 1) != 0 ? LogOdds(brick->value[voxel]) : LogOdds();
  }
  void vanished(const VoxelPayload& payload, geometry::VoxelKey key) {
    delta.vanished.push_back(point_of(payload, numbers, grid, key));
  }
};

/// Log-odds add up, and points come along.
struct Sum : OtherTree {
  std::vector<SurfaceId> surfaces{};  ///< as OccupancyMap::Merged

  static bool keeps(const Cube& cube, bool /*known*/) { return !cube.exists(); }
  LogOdds becomes(LogOdds here, LogOdds theirs) const {
    return here && theirs ? model.clamped(*here + *theirs) : theirs ? theirs : here;
  }
  static std::uint64_t points(const Cube& cube) { return cube.brick() == nullptr ? 0 : cube.brick()->points; }
  void meet(VoxelPayload& payload, const Cube& cube, unsigned voxel, geometry::VoxelKey key) {
    const VoxelPayload& theirs = tree.payloads_of(*cube.brick())[cube.brick()->rank(voxel)];
    const VoxelPoint before = point_of(payload, numbers, grid, key);
    const bool had_point = payload.has_point();
    if (had_point && theirs.range_class >= payload.range_class) return;
    payload = theirs;
    payload.surface = SurfaceNumbers::of(before.surface) & 0xffffff;
    if (had_point) {
      delta.refined.push_back({before, point_of(payload, numbers, grid, key)});
    } else {
      delta.appeared.push_back(point_of(payload, numbers, grid, key));
      surfaces.push_back(tree.numbers.id(theirs.surface));
    }
  }
};

/// The other's state, without its points. Values at a clamp, such as all of a .bt, are only occupied or free:
/// log-odds here that agree with them stay.
struct Copy : OtherTree {
  static bool keeps(const Cube& /*cube*/, bool /*known*/) { return false; }
  LogOdds becomes(LogOdds here, LogOdds theirs) const {
    if (!theirs) return {};
    const bool saturated = *theirs <= model.clamp_min || *theirs >= model.clamp_max;
    const bool agrees = here && (*here >= model.occupied) == (*theirs >= model.occupied);
    return saturated && agrees ? here : model.clamped(*theirs);
  }
};

/// A region becomes unknown, or has one value. The middles of voxels decide.
struct Clearing {
  enum class Meets { nothing, some, all };
  struct Cube {
    std::uint64_t morton;  ///< of its corner, in its own edges
    int level;
    Meets meets;
  };
  const SurfaceNumbers& numbers;
  const geometry::VoxelGrid& grid;
  const SpacePart& region;
  LogOdds value;
  OccupancyDelta delta{};

  Cube root() const { return cube(0, VoxelTree::top_level); }
  static bool keeps(const Cube& cube, bool known) { return !known || cube.meets == Meets::nothing; }
  static bool is_uniform(const Cube& cube) { return cube.meets == Meets::all; }
  Cube part(const Cube& of, unsigned c) const { return cube(of.morton << 3 | c, of.level - 1); }
  static bool at(const Cube& cube) { return cube.meets != Meets::nothing; }
  bool at(const Cube& brick, unsigned voxel) const { return at(cube(brick.morton << 6 | voxel, 0)); }
  LogOdds becomes(LogOdds here, bool inside) const { return here && inside ? value : here; }
  void vanished(const VoxelPayload& payload, geometry::VoxelKey key) {
    delta.vanished.push_back(point_of(payload, numbers, grid, key));
  }

 private:
  Cube cube(std::uint64_t morton, int level) const {
    const double half = (std::ldexp(grid.resolution(), level) - grid.resolution()) / 2;
    const Eigen::Vector3d middle = grid.corner_of(VoxelTree::key_of(morton << (3 * level))) +
                                   Eigen::Vector3d::Constant(half + grid.resolution() / 2);
    const double distance = region.distance(middle), reach = half * std::numbers::sqrt3;
    return {morton, level, distance > reach ? Meets::nothing : distance <= -reach ? Meets::all : Meets::some};
  }
};

}  // namespace

template <class Operation>
void VoxelTree::combine(Slot& slot, int level, std::uint64_t morton, const typename Operation::Cube& operand,
                        Operation& operation) {
  if (operation.keeps(operand, slot.link != unknown)) return;
  if (slot.link < first_link && operation.is_uniform(operand)) {
    const LogOdds here = slot.link == leaf ? LogOdds(slot.value) : LogOdds();
    const LogOdds now = operation.becomes(here, operation.at(operand));
    slot = now ? Slot{leaf, *now} : Slot{};
    return;
  }
  if (level == brick_level) return combine_brick(slot, morton, operand, operation);
  Group& children = divided(slot);
  for (unsigned c = 0; c < 8; ++c)
    combine(children[c], level - 1, morton << 3 | c, operation.part(operand, c), operation);
  if (std::ranges::all_of(children, [](const Slot& child) { return child.link == unknown; }))
    forget(slot, level);
  else
    close(slot);
}

template <class Operation>
void VoxelTree::combine_brick(Slot& slot, std::uint64_t brick_morton, const typename Operation::Cube& operand,
                              Operation& operation) {
  Brick& b = brick_at(slot);
  std::uint64_t known = 0;
  for (unsigned i = 0; i < 64; ++i) {
    const LogOdds here = (b.known >> i & 1) != 0 ? LogOdds(b.value[i]) : LogOdds();
    const LogOdds now = operation.becomes(here, operation.at(operand, i));
    b.value[i] = now.value_or(-std::numeric_limits<float>::infinity());  // its point vanishes
    known |= std::uint64_t{now.has_value()} << i;
  }
  b.known = known;
  if (b.points != 0) drop_vanished(b, brick_morton, b.points, operation);
  for (std::uint64_t m = ~known; m != 0; m &= m - 1) b.value[static_cast<unsigned>(std::countr_zero(m))] = 0;
  if constexpr (requires { operation.points(operand); })
    for (std::uint64_t m = operation.points(operand); m != 0; m &= m - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(m));
      if (occupied(b.value[i])) operation.meet(payload(b, i), operand, i, key_of(brick_morton << 6 | i));
    }
  if (known == 0)
    forget(slot, brick_level);
  else
    close_brick(slot);
}

OccupancyMap::Merged OccupancyMap::merge(const OccupancyMap& other) {
  Sum sum{{*other.tree_, tree_->numbers, tree_->model(), grid_}};
  tree_->expect_leaves_of(*other.tree_);
  tree_->combine(sum);
  return {std::move(sum.delta), std::move(sum.surfaces)};
}

OccupancyDelta OccupancyMap::replace(const OccupancyMap& other) {
  Copy copy{{*other.tree_, tree_->numbers, tree_->model(), grid_}};
  tree_->expect_leaves();
  tree_->combine(copy);
  copy.delta.appeared = adopt_occupied_voxels();
  return std::move(copy.delta);
}

OccupancyDelta OccupancyMap::clear(const SpacePart& part, bool as_free) {
  Clearing clearing{tree_->numbers, grid_, part, as_free ? LogOdds(tree_->model().miss) : LogOdds()};
  tree_->combine(clearing);
  return std::move(clearing.delta);
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
