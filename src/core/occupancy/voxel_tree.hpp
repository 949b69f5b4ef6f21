#pragma once

#include "geometry/interruption.hpp"
#include "geometry/morton.hpp"
#include "geometry/voxel_key.hpp"
#include "occupancy/payload_store.hpp"
#include "occupancy/pool.hpp"
#include "occupancy/surface_numbers.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <octosurf/adapters/detail/scan_rays.hpp>

namespace octosurf::occupancy {

/// OctoMap's occupancy model as log-odds, in its own arithmetic.
struct OccupancyModel {
  float hit = 0, miss = 0, clamp_min = 0, clamp_max = 0, occupied = 0;
  float clamped(float v) const { return v < clamp_min ? clamp_min : v > clamp_max ? clamp_max : v; }
};

/// OctoMap's octree in another layout: 16 levels, undivided where all below is equal. Down to cubes of 4³
/// voxels a node's eight children are one cache line of links and values; below that is a brick with the
/// values of 64 voxels. A brick takes 280 bytes, which OctoMap needs for the nodes above a single leaf; a
/// scan's masks of hits and misses are applied to it word by word. Inner nodes store no value, because the
/// maximum of a node is never used; files compute it.
///
/// share() gives readers the current tree; it costs a copy of the pools' tables, and of each chunk that is
/// written to afterwards. Divided nodes store the number of shares before their last write, which finds the
/// changes between two shares without visiting the rest, and whether they may contain occupied voxels, so
/// that searches for those skip free space: most of a map.
///
/// 1. Undivided wherever eight children are leaves of one value without points.
/// 2. A voxel with a point is occupied.
class VoxelTree {
 public:
  struct Brick;

  explicit VoxelTree(const OccupancyModel& occupancy_model);

  const OccupancyModel& model() const { return model_; }
  void clear() { *this = VoxelTree(model_); }
  bool occupied(float log_odds) const { return log_odds >= model_.occupied; }
  bool empty() const { return root_.link == unknown; }

  /// Applies a scan's blocks (ascending Morton order) in one descent. Equals updating voxel by voxel,
  /// because a voxel occurs at most once. Policy:
  /// - `bool keep(const VoxelPayload&, VoxelKey)`: before a miss at a point; true: it does not count.
  /// - `void vanished(const VoxelPayload&, VoxelKey)`: a point's voxel is no longer occupied.
  /// - `void hit(VoxelPayload&, VoxelKey)`: the voxel was hit and is occupied; fill in or refine.
  template <class Policy>
  void apply(std::span<const detail::TouchedBlock> blocks, Policy& policy) {
    if (!blocks.empty()) descend(root_, top_level, blocks, policy);
  }

  /// Makes of each voxel what an operation says of it and of its operand: another tree on the same grid, not
  /// this one, or a region of space. `becomes` may make no voxel occupied without a point, unless
  /// expect_leaves(). O(nodes that meet the operand, and of this tree in its uniform cubes). Operation:
  /// - `Cube`, `Cube root()`, `Cube part(Cube, unsigned child)`: of the operand, beside this tree's cubes.
  /// - `bool keeps(Cube, bool known)`: this tree stays as it is there; `known`: some of it is.
  /// - `bool is_uniform(Cube)`; then `at(Cube)`, else `at(Cube of brick_level, unsigned voxel)`: the operand.
  /// - `std::optional<float> becomes(std::optional<float> here, at)`: log-odds; none: unknown.
  /// - `void vanished(const VoxelPayload&, VoxelKey)`: as above.
  /// - `std::uint64_t points(Cube)`, `void meet(VoxelPayload&, Cube, unsigned voxel, VoxelKey)`, or neither:
  ///   of a brick's voxels with points in the operand, those that are occupied now; fill in or refine.
  ///   Ascending Morton order.
  template <class Operation>
  void combine(Operation& operation) {
    combine(root_, top_level, 0, operation.root(), operation);
  }

  struct Lookup {
    bool known = false;
    float log_odds = 0;
    int level = 0;  ///< of the undivided node that contains it, or at which the search ended as unknown
    const VoxelPayload* payload = nullptr;
    PayloadPlace place{};  ///< of the payload
  };
  Lookup find(geometry::VoxelKey key) const;

  /// visit(const VoxelPayload&, VoxelKey, PayloadPlace, float log_odds) for the points of the cube of 2^level
  /// voxels (level ≥ 3) that holds `key`, in Morton order.
  template <class Visit>
  void visit_points(geometry::VoxelKey key, int level, Visit&& visit) const;
  /// Sets the surface of a point of voxel `key`, whose payload is here.
  void assign(geometry::VoxelKey key, PayloadPlace place, SurfaceId surface) {
    payloads_.writable(place.run)[place.rank].surface = SurfaceNumbers::of(surface) & 0xffffff;
    const std::uint64_t brick = geometry::morton_of(key.x, key.y, key.z) >> (3 * brick_level);
    if (shares_ > 0 && (assigned_.empty() || assigned_.back() != brick)) assigned_.push_back(brick);
  }

  /// A read-only view of the current tree, for any thread.
  std::shared_ptr<const VoxelTree> share();
  /// Number of earlier shares of this tree, including those of the tree it was shared from.
  std::uint32_t shares() const { return shares_; }
  /// The same of two only if one was shared from the other, or both from one.
  std::uint64_t history() const { return history_; }

  /// Starts recording the previous state until commit() or roll_back(): copies each chunk written to.
  void begin_changes();
  void commit() noexcept;
  void roll_back() noexcept;

  /// A node as in OctoMap's tree. Valid until the tree changes.
  class Node;
  Node root() const;
  /// visit(Node, VoxelKey corner) for every leaf, in Morton order.
  template <class Visit>
  void visit_leaves(Visit&& visit) const;

  /// Makes the cube of 2^level voxels with this corner one leaf (level 0: a voxel).
  void set_leaf(geometry::VoxelKey corner, int level, float log_odds);
  /// Makes the cube of 4³ voxels with this corner a brick, dividing nodes as needed; the same as set_leaf()
  /// for its voxels, without the descent from the root. For filling a tree; valid until another leaf is set.
  Brick& make_brick(geometry::VoxelKey corner) {
    expect_leaves();
    return brick_at(corner);
  }
  /// Before occupied voxels without points are made otherwise.
  void expect_leaves() {
    without_points_ = true;  // until share() has checked
    settled_ = false;
  }
  /// As of another tree, before its leaves are added.
  void expect_leaves_of(const VoxelTree& other) {
    without_points_ = without_points_ || (!other.empty() && other.without_points_);
  }
  static void set_leaf(Brick& b, geometry::VoxelKey corner, int level, float log_odds);
  /// The payload of an occupied voxel, created if absent; divides its ancestors.
  VoxelPayload& make_payload(geometry::VoxelKey key);

  /// Whether a voxel may be occupied without a point: voxels from files without points, and those only
  /// crossed by rays if the threshold is so low that they count as occupied.
  bool occupied_without_points() const { return without_points_ || occupied(model_.miss); }

  std::size_t bytes() const { return groups_.bytes() + bricks_.bytes() + payloads_.bytes(); }

  static constexpr int top_level = 16;
  static constexpr int brick_level = 2;

  /// A cube of 4³ voxels.
  struct Brick {
    std::array<float, 64> value{};  ///< by Morton index; 0 where unknown, OctoMap's prior
    std::uint64_t known = 0, points = 0;
    PayloadRun payloads;

    unsigned rank(unsigned i) const { return geometry::bit_count(points & ((std::uint64_t{1} << i) - 1)); }
  };
  const VoxelPayload* payloads_of(const Brick& b) const { return payloads_.at(b.payloads); }

  SurfaceNumbers numbers;  ///< of the payloads; as they were for a shared tree

  static geometry::VoxelKey key_of(std::uint64_t morton) {
    return {static_cast<std::uint16_t>(geometry::compact_bits(morton)),
            static_cast<std::uint16_t>(geometry::compact_bits(morton >> 1)),
            static_cast<std::uint16_t>(geometry::compact_bits(morton >> 2))};
  }

 private:
  static constexpr std::uint32_t unknown = 0, leaf = 1, first_link = 2;
  static constexpr std::uint64_t whole = ~std::uint64_t{0};

  struct Slot {
    std::uint32_t link = unknown;  // or leaf, or first_link + index of a group or brick
    float value = 0;               // of a leaf; else bits as set by mark()
  };
  using Group = std::array<Slot, 8>;

  static unsigned child_of(geometry::VoxelKey key, int level) {  // of the node above `level`
    return (key.x >> level & 1U) | (key.y >> level & 1U) << 1 | (key.z >> level & 1U) << 2;
  }
  static unsigned index_in_brick(geometry::VoxelKey key) {
    return static_cast<unsigned>(geometry::morton_of(key.x & 3U, key.y & 3U, key.z & 3U));
  }
  // Sets the bits of a divided slot at a write: twice shares_, and whether it may contain occupied voxels.
  void mark(Slot& slot, bool may_be_occupied) const {
    slot.value = std::bit_cast<float>(shares_ << 1 | std::uint32_t{may_be_occupied});
  }
  bool may_be_occupied(const Slot& slot) const {
    if (slot.link >= first_link) return (std::bit_cast<std::uint32_t>(slot.value) & 1) != 0;
    return slot.link == leaf && occupied(slot.value);
  }
  Group& writable_group(const Slot& slot) { return groups_.writable(slot.link - first_link); }
  const Group& group(const Slot& slot) const { return groups_[slot.link - first_link]; }
  Brick& writable_brick(const Slot& slot) { return bricks_.writable(slot.link - first_link); }
  const Brick& brick(const Slot& slot) const { return bricks_[slot.link - first_link]; }
  // Every write below a slot calls one of these two.
  Group& divided(Slot& slot);
  Brick& brick_at(Slot& slot);
  Brick& brick_at(geometry::VoxelKey key);
  void close(Slot& slot);
  void close_brick(Slot& slot);
  void forget(Slot& slot, int level);
  void settle(Slot& slot, int level);
  void mark_way_to(geometry::VoxelKey brick);
  void mark_assigned();
  VoxelPayload& payload(Brick& b, unsigned i);

  bool saturated(const Slot& slot) const { return slot.link == leaf && slot.value <= model_.clamp_min; }

  template <class Policy>
  void descend(Slot& slot, int level, std::span<const detail::TouchedBlock> blocks, Policy& policy);
  template <class Policy>
  void update_block(Slot& slot, const detail::TouchedBlock& block, Policy& policy);
  template <class Policy>
  void update_brick(Slot& slot, std::uint64_t brick_morton, std::uint64_t hits, std::uint64_t misses,
                    Policy& policy);
  template <class Policy>
  std::uint64_t kept(const Brick& b, std::uint64_t brick_morton, std::uint64_t misses, Policy& policy) const;
  template <class Policy>
  void drop_vanished(Brick& b, std::uint64_t brick_morton, std::uint64_t misses, Policy& policy);
  template <class Operation>
  void combine(Slot& slot, int level, std::uint64_t morton, const typename Operation::Cube& operand,
               Operation& operation);
  template <class Operation>
  void combine_brick(Slot& slot, std::uint64_t brick_morton, const typename Operation::Cube& operand,
                     Operation& operation);
  template <class Visit>
  void visit_below(const Slot& slot, std::uint64_t morton, int level, Visit& visit) const;

  OccupancyModel model_;
  std::uint64_t history_;     // shared only by this tree and the trees shared from it
  std::uint32_t shares_ = 0;  // two billion: 2.3 years at 30 Hz
  bool without_points_ = false;
  bool settled_ = true;                  // no leaf was set since the marks were updated
  std::vector<std::uint64_t> assigned_;  // bricks with a point assigned since the last share
  Slot root_, root_before_;              // the latter: at begin_changes()
  SurfaceNumbers numbers_before_;        // likewise
  Pool<Group, 10> groups_;
  Pool<Brick, 8> bricks_;
  PayloadStore payloads_;
};

class VoxelTree::Node {
 public:
  bool exists() const {
    return brick_ != nullptr ? (brick_->known >> first_ & 1) != 0 || has_children() : slot_->link != unknown;
  }
  bool has_children() const;
  Node child(unsigned c) const;  ///< needs has_children(); may not exist
  float log_odds() const { return brick_ != nullptr ? brick_->value[first_] : slot_->value; }  ///< of a leaf
  const VoxelPayload* payload() const;  ///< nullptr without a point
  /// False only if it is divided, at brick_level or above, and unchanged since the tree had been shared
  /// `shares` times: that share has the same contents there.
  bool written_since(std::uint32_t shares) const {
    return brick_ != nullptr || slot_->link < first_link ||
           std::bit_cast<std::uint32_t>(slot_->value) >> 1 > shares;
  }
  /// False only if it contains no occupied voxel. At brick_level and above.
  bool may_be_occupied() const { return tree_->may_be_occupied(*slot_); }
  int level() const { return level_; }
  /// For a divided node of brick_level; nullptr for all others.
  const Brick* brick() const {
    return level_ == brick_level && slot_->link >= first_link ? &tree_->brick(*slot_) : nullptr;
  }

 private:
  friend class VoxelTree;
  const VoxelTree* tree_ = nullptr;
  const Slot* slot_ = nullptr;    // at brick_level and above
  const Brick* brick_ = nullptr;  // below
  unsigned first_ = 0;            // voxel of the brick
  int level_ = top_level;
};

template <class Visit>
void VoxelTree::visit_leaves(Visit&& visit) const {
  const auto below = [&](const auto& self, const Node& node, std::uint64_t morton) -> void {
    if (!node.exists()) return;
    if (!node.has_children()) return visit(node, key_of(morton << (3 * node.level())));
    for (unsigned c = 0; c < 8; ++c) self(self, node.child(c), morton << 3 | c);
  };
  below(below, root(), 0);
}

template <class Policy>
void VoxelTree::descend(Slot& slot, int level, std::span<const detail::TouchedBlock> blocks, Policy& policy) {
  if (level == brick_level + 1) return update_block(slot, blocks.front(), policy);
  if (saturated(slot) && !detail::any_hit(blocks)) return;  // misses change nothing below
  geometry::end_if_interrupted();
  Group& children = divided(slot);
  detail::for_each_touched_child(blocks, 3 * (level - brick_level - 2),
                                 [&](unsigned child, std::span<const detail::TouchedBlock> below) {
                                   descend(children[child], level - 1, below, policy);
                                 });
  close(slot);
}

template <class Policy>
void VoxelTree::update_block(Slot& slot, const detail::TouchedBlock& block, Policy& policy) {
  if (!block.hit && saturated(slot)) return;
  Group& children = divided(slot);
  for (unsigned w = 0; w < 8; ++w)
    if ((block.hits[w] | block.misses[w]) != 0)
      update_brick(children[w], block.morton << 3 | w, block.hits[w], block.misses[w], policy);
  close(slot);
}

template <class Policy>
void VoxelTree::update_brick(Slot& slot, std::uint64_t brick_morton, std::uint64_t hits, std::uint64_t misses,
                             Policy& policy) {
  if (hits == 0 && saturated(slot)) return;
  Brick& b = brick_at(slot);
  if ((misses & b.points) != 0) misses = kept(b, brick_morton, misses, policy);
  for (std::uint64_t m = misses; m != 0; m &= m - 1) {
    float& value = b.value[static_cast<std::size_t>(std::countr_zero(m))];
    value = model_.clamped(value + model_.miss);
  }
  if ((misses & b.points) != 0) drop_vanished(b, brick_morton, misses & b.points, policy);
  for (std::uint64_t m = hits; m != 0; m &= m - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(m));
    float& value = b.value[i];
    value = model_.clamped(value + model_.hit);
    if (occupied(value)) policy.hit(payload(b, i), key_of(brick_morton << 6 | i));
  }
  b.known |= hits | misses;
  close_brick(slot);
}

/// The misses that count.
template <class Policy>
std::uint64_t VoxelTree::kept(const Brick& b, std::uint64_t brick_morton, std::uint64_t misses,
                              Policy& policy) const {
  const VoxelPayload* payloads = payloads_.at(b.payloads);
  for (std::uint64_t m = misses & b.points; m != 0; m &= m - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(m));
    if (policy.keep(payloads[b.rank(i)], key_of(brick_morton << 6 | i))) misses &= ~(std::uint64_t{1} << i);
  }
  return misses;
}

template <class Policy>
void VoxelTree::drop_vanished(Brick& b, std::uint64_t brick_morton, std::uint64_t misses, Policy& policy) {
  for (std::uint64_t m = misses; m != 0; m &= m - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(m));
    if (occupied(b.value[i])) continue;
    const unsigned rank = b.rank(i);
    policy.vanished(payloads_.at(b.payloads)[rank], key_of(brick_morton << 6 | i));
    payloads_.erase(b.payloads, rank, geometry::bit_count(b.points));
    b.points &= ~(std::uint64_t{1} << i);
  }
}

template <class Visit>
void VoxelTree::visit_points(geometry::VoxelKey key, int level, Visit&& visit) const {
  const Slot* slot = &root_;
  for (int l = top_level - 1; l >= level; --l) {
    if (slot->link < first_link) return;
    slot = &group(*slot)[child_of(key, l)];
  }
  visit_below(*slot, geometry::morton_of(key.x, key.y, key.z) >> (3 * level), level, visit);
}

template <class Visit>
void VoxelTree::visit_below(const Slot& slot, std::uint64_t morton, int level, Visit& visit) const {
  if (slot.link < first_link) return;
  if (level > brick_level) {
    const Group& children = group(slot);
    for (unsigned c = 0; c < 8; ++c) visit_below(children[c], morton << 3 | c, level - 1, visit);
    return;
  }
  const Brick& b = brick(slot);
  const VoxelPayload* payloads = payloads_.at(b.payloads);
  std::uint8_t rank = 0;
  for (std::uint64_t m = b.points; m != 0; m &= m - 1, ++rank)
    visit(payloads[rank], key_of(morton << 6 | static_cast<unsigned>(std::countr_zero(m))),
          PayloadPlace{b.payloads, rank}, b.value[static_cast<unsigned>(std::countr_zero(m))]);
}

}  // namespace octosurf::occupancy
