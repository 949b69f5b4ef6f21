#include "geometry/voxel_grid.hpp"
#include "occupancy/cubes.hpp"
#include "occupancy/nearest_voxel.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/occupancy.hpp>

namespace octosurf {
namespace {

using Voxel = OccupancyView::Voxel;
using State = OccupancyView::State;
using occupancy::centre_of;
using occupancy::child_corner;
using occupancy::ints;
using occupancy::Key3;
using occupancy::key_of;
using occupancy::KeyBox;
using Node = occupancy::VoxelTree::Node;

/// Calls `visit(node, corner)` for the bricks and uniform cubes that meet a box, those with known voxels or
/// only those that may have occupied ones, in Morton order, until it returns false.
template <class Visit>
bool visit_cubes(const Node& node, const Key3& corner, const KeyBox& box, bool occupied_only,
                 const Visit& visit) {
  if (occupied_only ? !node.may_be_occupied() : !node.exists()) return true;
  if (!box.meets(KeyBox::cube(corner, node.level()))) return true;
  if (node.brick() != nullptr || !node.has_children()) return visit(node, corner);
  for (unsigned c = 0; c < 8; ++c)
    if (!visit_cubes(node.child(c), child_corner(corner, c, node.level() - 1), box, occupied_only, visit))
      return false;
  return true;
}

/// Mask of a brick's voxels that lie in a box.
std::uint64_t voxels_in(const KeyBox& box, const Key3& brick_corner) {
  if (box.holds(KeyBox::cube(brick_corner, occupancy::VoxelTree::brick_level))) return ~std::uint64_t{0};
  std::uint64_t mask = 0;
  for (unsigned i = 0; i < 64; ++i) mask |= std::uint64_t{box.holds(occupancy::key_in(brick_corner, i))} << i;
  return mask;
}

/// Calls `visit(key)` for the voxels of a box in Morton order, until it returns false.
template <class Visit>
bool each_key(const KeyBox& box, const Key3& corner, int level, Visit& visit) {
  if (!box.meets(KeyBox::cube(corner, level))) return true;
  if (level == 0) return visit(corner);
  for (unsigned c = 0; c < 8; ++c)
    if (!each_key(box, child_corner(corner, c, level - 1), level - 1, visit)) return false;
  return true;
}

/// The uniform cubes along a segment, from the first to the last.
class Way {
 public:
  Way(const occupancy::VoxelTree& tree, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
      double resolution)
      : tree_(tree),
        from_(from / resolution + Eigen::Vector3d::Constant(geometry::VoxelGrid::origin)),
        along_((to - from) / resolution) {}

  /// Steps from cube to cube until `stops(known, log_odds)`; returns that voxel's key.
  template <class Stops>
  std::optional<Key3> first(const Stops& stops) const {
    Key3 key;
    for (std::size_t i = 0; i < 3; ++i) key[i] = static_cast<int>(std::floor(from_[axis(i)]));
    double t = 0;
    for (;;) {
      occupancy::VoxelTree::Lookup found;
      found.level = 0;
      if (KeyBox{}.holds(key)) found = tree_.find(key_of(key));
      if (stops(found.known, found.log_odds)) return key;
      if (!step(key, KeyBox::cube(corner_of(key, found.level), found.level), t)) return {};
    }
  }

 private:
  static Eigen::Index axis(std::size_t i) { return static_cast<Eigen::Index>(i); }
  static Key3 corner_of(const Key3& key, int level) {
    const int mask = ~((1 << level) - 1);
    return {key[0] & mask, key[1] & mask, key[2] & mask};
  }

  /// To the voxel behind `cube`, along the axis that leaves it first; false if the segment ends before.
  bool step(Key3& key, const KeyBox& cube, double& t) const {
    std::size_t leaving = 3;
    double nearest = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      if (along_[axis(i)] == 0) continue;
      const int face = along_[axis(i)] > 0 ? cube.high[i] + 1 : cube.low[i];
      const double at = std::max(t, (face - from_[axis(i)]) / along_[axis(i)]);
      // A segment that ends on a face has reached the voxel above it, not the one below.
      if (at < nearest || (at == nearest && leaving == 3 && along_[axis(i)] > 0)) {
        nearest = at;
        leaving = i;
      }
    }
    if (leaving == 3) return false;
    t = nearest;
    for (std::size_t i = 0; i < 3; ++i) {
      const int at = static_cast<int>(std::floor(from_[axis(i)] + t * along_[axis(i)]));
      key[i] = i != leaving          ? std::clamp(at, cube.low[i], cube.high[i])
               : along_[axis(i)] > 0 ? cube.high[i] + 1
                                     : cube.low[i] - 1;
    }
    return true;
  }

  const occupancy::VoxelTree& tree_;
  Eigen::Vector3d from_, along_;  // in voxels
};

/// Cuts a segment to the octree's cube, with a margin of a voxel; false if it does not meet it.
bool cut_to_octree(Eigen::Vector3d& from, Eigen::Vector3d& to, double resolution) {
  const double half = (geometry::VoxelGrid::origin + 1) * resolution;
  const Eigen::Vector3d along = to - from;
  double t0 = 0, t1 = 1;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (along[i] == 0) {
      if (std::fabs(from[i]) > half) return false;
      continue;
    }
    const double a = (-half - from[i]) / along[i], b = (half - from[i]) / along[i];
    t0 = std::max(t0, std::min(a, b));
    t1 = std::min(t1, std::max(a, b));
  }
  if (t0 > t1) return false;
  to = from + t1 * along;
  from += t0 * along;
  return true;
}

/// Sets what the payload of an occupied voxel says, if it has one.
void set_readings(Voxel& voxel, const Key3& key, const occupancy::VoxelPayload* payload,
                  const occupancy::SurfaceNumbers& numbers, double resolution) {
  voxel.point = voxel.center;
  if (payload == nullptr) return;
  voxel.surface = numbers.id(payload->surface);
  if (!payload->has_point()) return;
  voxel.point = occupancy::load_point(*payload, geometry::VoxelGrid(resolution), key_of(key));
  voxel.view = sensing::views[payload->view].cast<double>();
  voxel.range_m = sensing::range_of_class(payload->range_class);
}

void require_finite(const Eigen::Vector3d& point, const char* where) {
  if (!point.allFinite()) throw Error(Error::Kind::usage, where, "the point is not finite");
}

}  // namespace

OccupancyView::OccupancyView() = default;
OccupancyView::OccupancyView(std::shared_ptr<const occupancy::VoxelTree> tree, double resolution)
    : tree_(std::move(tree)), resolution_(resolution) {}

float OccupancyView::occupied_from() const { return tree_ ? tree_->model().occupied : 0; }

Voxel OccupancyView::at(const Eigen::Vector3d& point) const {
  if (tree_ == nullptr) return {};
  const Eigen::Array3d scaled = (point / resolution_).array() + geometry::VoxelGrid::origin;
  if (!(scaled >= 0).all() || !(scaled < geometry::VoxelGrid::last + 1).all()) return {};
  const Key3 key{static_cast<int>(scaled.x()), static_cast<int>(scaled.y()), static_cast<int>(scaled.z())};
  return voxel(key_of(key));
}

Voxel OccupancyView::voxel(const geometry::VoxelKey& key) const {
  const occupancy::VoxelTree::Lookup found = tree_->find(key);
  Voxel voxel;
  voxel.center = voxel.point = centre_of(ints(key), resolution_);
  if (!found.known) return voxel;
  voxel.state = tree_->occupied(found.log_odds) ? State::occupied : State::free;
  voxel.log_odds = found.log_odds;
  set_readings(voxel, ints(key), found.payload, tree_->numbers, resolution_);
  return voxel;
}

std::optional<Voxel> OccupancyView::first_on_way(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                                 bool unknown_stops) const {
  require_finite(from, "from");
  require_finite(to, "to");
  if (unknown_stops && at(from).state == State::unknown) return at(from);
  Eigen::Vector3d first = from, last = to;
  if (tree_ == nullptr || !cut_to_octree(first, last, resolution_)) return {};
  const auto stops = [&](bool known, float log_odds) {
    return known ? tree_->occupied(log_odds) : unknown_stops;
  };
  const std::optional<Key3> key = Way(*tree_, first, last, resolution_).first(stops);
  if (!key) return {};
  if (KeyBox{}.holds(*key)) return voxel(key_of(*key));
  Voxel outside;
  outside.center = centre_of(*key, resolution_);
  return outside;
}

void OccupancyView::for_each_occupied(const Eigen::AlignedBox3d& box,
                                      const std::function<bool(const Voxel&)>& visit) const {
  occupancy::require_box(box);
  if (tree_ == nullptr || box.isEmpty()) return;
  const KeyBox keys = occupancy::keys_in(box, resolution_);
  const auto one = [&](const Key3& key, float log_odds, const occupancy::VoxelPayload* payload) {
    Voxel voxel{State::occupied, log_odds, 0, centre_of(key, resolution_)};
    set_readings(voxel, key, payload, tree_->numbers, resolution_);
    return visit(voxel);
  };
  if (keys.voxels() == 0) return;
  visit_cubes(tree_->root(), {0, 0, 0}, keys, true, [&](const Node& node, const Key3& corner) {
    if (const occupancy::VoxelTree::Brick* brick = node.brick()) {
      for (std::uint64_t m = occupancy::occupied_in(*tree_, *brick) & voxels_in(keys, corner); m != 0;
           m &= m - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(m));
        const bool has_point = (brick->points >> i & 1) != 0;
        if (!one(occupancy::key_in(corner, i), brick->value[i],
                 has_point ? tree_->payloads_of(*brick) + brick->rank(i) : nullptr))
          return false;
      }
      return true;
    }
    const auto in_leaf = [&](const Key3& key) { return one(key, node.log_odds(), nullptr); };
    return !tree_->occupied(node.log_odds()) || each_key(keys, corner, node.level(), in_leaf);
  });
}

OccupancyView::Count OccupancyView::count(const Eigen::AlignedBox3d& box) const {
  occupancy::require_box(box);
  Count count;
  if (tree_ == nullptr || box.isEmpty()) return count;
  const KeyBox keys = occupancy::keys_in(box, resolution_);
  count.unknown = keys.voxels();
  if (count.unknown == 0) return count;
  visit_cubes(tree_->root(), {0, 0, 0}, keys, false, [&](const Node& node, const Key3& corner) {
    const occupancy::VoxelTree::Brick* brick = node.brick();
    const std::uint64_t wanted = brick == nullptr ? 0 : voxels_in(keys, corner);
    const std::size_t known = brick == nullptr ? keys.cut(KeyBox::cube(corner, node.level())).voxels()
                                               : geometry::bit_count(brick->known & wanted);
    const std::size_t occupied = brick != nullptr
                                     ? geometry::bit_count(occupancy::occupied_in(*tree_, *brick) & wanted)
                                 : tree_->occupied(node.log_odds()) ? known
                                                                    : 0;
    count.occupied += occupied;
    count.free += known - occupied;
    count.unknown -= known;
    return true;
  });
  return count;
}

SurfaceId occupancy::Cube::surface(unsigned voxel) const {
  if ((points >> voxel & 1) == 0) return 0;
  return numbers->id(payloads[geometry::bit_count(points & ~(~0ULL << voxel))].surface);
}

std::vector<Eigen::AlignedBox3d> occupancy::changed_cubes(const OccupancyView& before,
                                                          const OccupancyView& now) {
  std::vector<Eigen::AlignedBox3d> changed;
  const geometry::VoxelGrid grid(now.resolution());
  now.for_each_changed_cube(before, [&](const std::array<std::uint16_t, 3>& corner, int level) {
    const Eigen::Vector3d low = grid.corner_of({corner[0], corner[1], corner[2]});
    changed.emplace_back(low, low.array() + std::ldexp(now.resolution(), level));
  });
  return changed;
}

void occupancy::for_each_cube(const OccupancyView& view, const Eigen::AlignedBox3d& box,
                              const std::function<bool(const Cube&)>& visit, bool occupied_only) {
  require_box(box);
  const VoxelTree* tree = view.tree();
  if (tree == nullptr || box.isEmpty()) return;
  Cube cube;
  cube.numbers = &tree->numbers;
  visit_cubes(tree->root(), {0, 0, 0}, keys_that_meet(box, view.resolution()), occupied_only,
              [&](const Node& node, const Key3& corner) {
                cube.corner = corner_of(corner);
                cube.level = static_cast<std::uint8_t>(node.level());
                if (const VoxelTree::Brick* brick = node.brick()) {
                  cube.known = brick->known;
                  cube.occupied = occupied_in(*tree, *brick);
                  cube.payloads = tree->payloads_of(*brick);
                  cube.points = brick->points;
                } else {
                  cube.known = ~std::uint64_t{0};
                  cube.occupied = tree->occupied(node.log_odds()) ? cube.known : 0;
                  cube.points = 0;
                }
                return visit(cube);
              });
}

std::optional<Voxel> OccupancyView::nearest_occupied(const Eigen::Vector3d& point, double limit) const {
  require_finite(point, "nearest_occupied");
  if (!(limit >= 0 && std::isfinite(limit)))
    throw Error(Error::Kind::usage, "limit", "is not a distance", "must be finite and at least 0");
  if (tree_ == nullptr) return {};
  const occupancy::NearestSearch search(*tree_, point, resolution_, limit);
  if (!search.found()) return {};
  return voxel(key_of(search.key()));
}

}  // namespace octosurf
