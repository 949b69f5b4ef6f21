#include "geometry/voxel_grid.hpp"
#include "occupancy/nearest_voxel.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <array>
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
using occupancy::last_key;
using occupancy::may_be_occupied;

enum class Walked { all, occupied };  ///< known voxels, or a superset of the occupied ones

/// Calls `visit(box, log_odds, payload)` for the known parts of a box of voxels, in Morton order of their
/// corners: uniform cubes, cut to the box. `visit` returns false to stop.
template <Walked walked, class Visit>
class BoxWalk {
 public:
  BoxWalk(const occupancy::VoxelTree& tree, const KeyBox& box, Visit& visit)
      : tree_(tree), box_(box), visit_(visit) {}

  bool run() { return below(tree_.root(), {0, 0, 0}); }

 private:
  bool below(const occupancy::VoxelTree::Node& node, const Key3& corner) {
    if (walked == Walked::occupied ? !node.may_be_occupied() : !node.exists()) return true;
    const KeyBox part = box_.cut(KeyBox::cube(corner, node.level()));
    if (part.voxels() == 0) return true;
    if (const occupancy::VoxelTree::Brick* brick = node.brick()) return in_brick(*brick, corner);
    if (!node.has_children()) return visit_(part, node.log_odds(), nullptr);
    for (unsigned c = 0; c < 8; ++c)
      if (!below(node.child(c), child_corner(corner, c, node.level() - 1))) return false;
    return true;
  }
  bool in_brick(const occupancy::VoxelTree::Brick& brick, const Key3& corner) {
    const std::uint64_t looked_at = walked == Walked::occupied ? may_be_occupied(tree_, brick) : brick.known;
    for (std::uint64_t m = looked_at; m != 0; m &= m - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(m));
      const geometry::VoxelKey inside = occupancy::VoxelTree::key_of(i);
      const Key3 key{corner[0] + inside.x, corner[1] + inside.y, corner[2] + inside.z};
      if (!box_.holds(key)) continue;
      const occupancy::VoxelPayload* payload =
          (brick.points >> i & 1) != 0 ? tree_.payloads_of(brick) + brick.rank(i) : nullptr;
      if (!visit_(KeyBox{key, key}, brick.value[i], payload)) return false;
    }
    return true;
  }

  const occupancy::VoxelTree& tree_;
  KeyBox box_;
  Visit& visit_;
};

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
void set_readings(Voxel& voxel, const Key3& key, const occupancy::VoxelPayload* payload, double resolution) {
  voxel.point = voxel.center;
  if (payload == nullptr) return;
  voxel.surface = payload->surface;
  if (!payload->has_point()) return;
  voxel.point = occupancy::load_point(*payload, geometry::VoxelGrid(resolution), key_of(key)).cast<double>();
  voxel.view = sensing::views[payload->view].cast<double>();
  voxel.range_m = sensing::range_of_class(payload->range_class);
}

void require_finite(const Eigen::Vector3d& point, const char* where) {
  if (!point.allFinite()) throw Error(Error::Kind::usage, where, "the point is not finite");
}

void require_box(const Eigen::AlignedBox3d& box) {
  if (box.min().hasNaN() || box.max().hasNaN()) throw Error(Error::Kind::usage, "box", "is not a number");
}

}  // namespace

OccupancyView::OccupancyView() = default;
OccupancyView::OccupancyView(std::shared_ptr<const occupancy::VoxelTree> tree, double resolution)
    : tree_(std::move(tree)), resolution_(resolution) {}

float OccupancyView::occupied_from() const { return tree_ ? tree_->model().occupied : 0; }

Voxel OccupancyView::at(const Eigen::Vector3d& point) const {
  if (tree_ == nullptr) return {};
  const Eigen::Array3d scaled = (point / resolution_).array() + geometry::VoxelGrid::origin;
  if (!(scaled >= 0).all() || !(scaled < last_key + 1).all()) return {};
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
  set_readings(voxel, ints(key), found.payload, resolution_);
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
  require_box(box);
  if (tree_ == nullptr || box.isEmpty()) return;
  const auto in_part = [&](const KeyBox& part, float log_odds, const occupancy::VoxelPayload* payload) {
    if (!tree_->occupied(log_odds)) return true;
    const auto one = [&](const Key3& key) {
      Voxel voxel{State::occupied, log_odds, 0, centre_of(key, resolution_)};
      set_readings(voxel, key, payload, resolution_);
      return visit(voxel);
    };
    return part.voxels() == 1 ? one(part.low)
                              : each_key(part, {0, 0, 0}, occupancy::VoxelTree::top_level, one);
  };
  BoxWalk<Walked::occupied, decltype(in_part)>(*tree_, occupancy::keys_in(box, resolution_), in_part).run();
}

OccupancyView::Count OccupancyView::count(const Eigen::AlignedBox3d& box) const {
  require_box(box);
  Count count;
  if (tree_ == nullptr || box.isEmpty()) return count;
  const auto in_part = [&](const KeyBox& part, float log_odds, const occupancy::VoxelPayload*) {
    (tree_->occupied(log_odds) ? count.occupied : count.free) += part.voxels();
    return true;
  };
  const KeyBox keys = occupancy::keys_in(box, resolution_);
  BoxWalk<Walked::all, decltype(in_part)>(*tree_, keys, in_part).run();
  count.unknown = keys.voxels() - count.free - count.occupied;
  return count;
}

std::optional<OccupancyView::Near> OccupancyView::nearest_occupied(const Eigen::Vector3d& point,
                                                                   double limit) const {
  require_finite(point, "nearest_occupied");
  if (!(limit >= 0 && std::isfinite(limit)))
    throw Error(Error::Kind::usage, "limit", "is not a distance", "must be finite and at least 0");
  if (tree_ == nullptr) return {};
  const occupancy::NearestSearch search(*tree_, point, resolution_, limit);
  if (!search.found()) return {};
  const Voxel found = voxel(key_of(search.key()));
  return Near{found, (found.center - point).norm()};
}

}  // namespace octosurf
