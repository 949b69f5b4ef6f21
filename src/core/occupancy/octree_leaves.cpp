// Reads and writes the octree leaf by leaf, to build and update another octree.
#include "occupancy/nearest_voxel.hpp"
#include "occupancy/occupancy_map.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/occupancy.hpp>

namespace octosurf {
namespace {

using Leaf = OccupancyView::Leaf;
using Node = occupancy::VoxelTree::Node;
using occupancy::child_corner;
using occupancy::corner_of;
using occupancy::Key3;
using occupancy::KeyBox;
using occupancy::occupied_in;

/// Collects leaves in Morton order; passes them on in batches of some thousands, if there is a `visit`.
class LeafCollector {
 public:
  LeafCollector(const KeyBox& range, std::vector<Leaf>& leaves, const OccupancyView::VisitLeaves* visit)
      : range_(range), leaves_(leaves), visit_(visit) {}

  void collect(const Node& node, const Key3& corner) { below(node, corner); }
  void collect_octet(const occupancy::VoxelTree::Brick& brick, unsigned octet, const Key3& corner) {
    in_octet(brick, octet, corner);
  }
  void hand_on() {
    if (!leaves_.empty()) (*visit_)(leaves_);
    leaves_.clear();
  }

 private:
  static constexpr std::size_t enough = 4096;

  /// True if the node is one leaf, which is now the last one.
  bool below(const Node& node, const Key3& corner) {
    if (!node.exists() || !range_.meets(KeyBox::cube(corner, node.level()))) return false;
    if (const occupancy::VoxelTree::Brick* brick = node.brick()) return in_brick(*brick, corner);
    if (!node.has_children()) {
      add(corner, node.level(), node.log_odds());
      return true;
    }
    bool all = true;
    for (unsigned c = 0; c < 8; ++c)
      all = below(node.child(c), child_corner(corner, c, node.level() - 1)) && all;
    if (all && merge(corner, node.level())) return true;
    // No ancestor is a single leaf either, so the collected leaves are final.
    if (visit_ != nullptr && leaves_.size() >= enough) hand_on();
    return false;
  }

  bool in_brick(const occupancy::VoxelTree::Brick& brick, const Key3& corner) {
    bool all = true;
    for (unsigned octet = 0; octet < 8; ++octet)
      all = in_octet(brick, octet, child_corner(corner, octet, 1)) && all;
    return all && merge(corner, occupancy::VoxelTree::brick_level);
  }

  bool in_octet(const occupancy::VoxelTree::Brick& brick, unsigned octet, const Key3& corner) {
    const auto known = static_cast<unsigned>(brick.known >> (8 * octet) & 0xff);
    const float* values = brick.value.data() + 8 * octet;
    if (known == 0xff && range_.meets(KeyBox::cube(corner, 1)) &&
        std::all_of(values, values + 8, [&](float v) { return v == *values; })) {
      add(corner, 1, *values);
      return true;
    }
    for (unsigned i = 0; i < 8; ++i)
      if (const Key3 voxel = child_corner(corner, i, 0); (known >> i & 1) != 0 && range_.holds(voxel))
        add(voxel, 0, values[i]);
    return false;
  }

  void add(const Key3& corner, int level, float log_odds) {
    leaves_.push_back({corner_of(corner), static_cast<std::uint8_t>(level), log_odds});
  }

  /// Merges the last eight leaves, which fill the cube, if they are equal.
  bool merge(const Key3& corner, int level) {
    const float value = leaves_.back().log_odds;
    if (std::any_of(leaves_.end() - 8, leaves_.end(),
                    [&](const Leaf& leaf) { return leaf.log_odds != value; }))
      return false;
    leaves_.resize(leaves_.size() - 8);
    add(corner, level, value);
    return true;
  }

  KeyBox range_;
  std::vector<Leaf>& leaves_;
  const OccupancyView::VisitLeaves* visit_;
};

/// All leaves of a tree in a range.
void visit_leaves(const occupancy::VoxelTree& tree, const KeyBox& range,
                  const OccupancyView::VisitLeaves& visit) {
  std::vector<Leaf> leaves;
  LeafCollector collector(range, leaves, &visit);
  collector.collect(tree.root(), {0, 0, 0});
  collector.hand_on();
}

/// Where two trees were shared from one, unchanged nodes need no comparison.
class History {
 public:
  History(const occupancy::VoxelTree& before, const occupancy::VoxelTree& now)
      : related_(now.same_history(before)),
        forward_(now.shares() >= before.shares()),
        shares_(std::min(before.shares(), now.shares())) {}

  bool same(const Node& before, const Node& now) const {
    return related_ && !(forward_ ? now : before).written_since(shares_);
  }

 private:
  bool related_, forward_;  // forward: `now` is the later one
  std::uint32_t shares_;    // before the earlier of the two
};

/// Traverses two trees in parallel.
class Comparison {
 public:
  Comparison(const occupancy::VoxelTree& before, const occupancy::VoxelTree& now,
             const OccupancyView::VisitChange& visit)
      : visit_(visit), history_(before, now) {
    compare(before.root(), now.root(), {0, 0, 0});
  }

 private:
  /// `before` covers the same cube; if it is one leaf it may be larger.
  void compare(const Node& before, const Node& now, const Key3& corner) {
    if (history_.same(before, now)) return;
    if (!now.has_children()) {
      if (before.has_children() || before.exists() != now.exists() ||
          (now.exists() && before.log_odds() != now.log_odds()))
        changed(now, corner);
    } else if (!before.exists()) {
      changed(now, corner);
    } else if (const occupancy::VoxelTree::Brick* is = now.brick()) {
      compare_octets(before, *is, corner);
    } else {
      for (unsigned c = 0; c < 8; ++c)
        compare(before.has_children() ? before.child(c) : before, now.child(c),
                child_corner(corner, c, now.level() - 1));
    }
  }

  void compare_octets(const Node& before, const occupancy::VoxelTree::Brick& is, const Key3& corner) {
    const occupancy::VoxelTree::Brick* was = before.brick();
    // A write copies a whole chunk, so most of its nodes are equal: a bitwise comparison is fast.
    if (was == &is || (was != nullptr && was->known == is.known &&
                       std::memcmp(was->value.data(), is.value.data(), sizeof is.value) == 0))
      return;
    for (unsigned octet = 0; octet < 8; ++octet) {
      bool same = true;
      for (unsigned i = 8 * octet; i < 8 * octet + 8; ++i) {
        const bool was_known = was == nullptr || (was->known >> i & 1) != 0;
        const float was_value = was == nullptr ? before.log_odds() : was->value[i];
        same = same && was_known == ((is.known >> i & 1) != 0) && was_value == is.value[i];
      }
      if (same) continue;
      const Key3 at = child_corner(corner, octet, 1);
      leaves_.clear();
      LeafCollector(KeyBox{}, leaves_, nullptr).collect_octet(is, octet, at);
      visit_(corner_of(at), 1, leaves_);
    }
  }

  void changed(const Node& now, const Key3& corner) {
    leaves_.clear();
    LeafCollector(KeyBox{}, leaves_, nullptr).collect(now, corner);
    visit_(corner_of(corner), static_cast<std::uint8_t>(now.level()), leaves_);
  }

  const OccupancyView::VisitChange& visit_;
  History history_;
  std::vector<Leaf> leaves_;
};

using Brick = occupancy::VoxelTree::Brick;

/// Finds the cubes in which a voxel's state or payload changed.
class StateComparison {
 public:
  using Visit = std::function<void(const std::array<std::uint16_t, 3>& corner, int level)>;

  StateComparison(const occupancy::VoxelTree& before, const occupancy::VoxelTree& now, const Visit& visit)
      : before_(before), now_(now), history_(before, now), visit_(visit) {
    compare(before.root(), now.root(), {0, 0, 0}, occupancy::VoxelTree::top_level);
  }

 private:
  struct Contents {
    std::uint64_t known = 0, occupied = 0;
    std::span<const occupancy::VoxelPayload> payloads{};
  };
  static Contents contents_of(const occupancy::VoxelTree& tree, const Node& node) {
    if (const Brick* brick = node.has_children() ? node.brick() : nullptr)
      return {brick->known,
              occupied_in(tree, *brick),
              {tree.payloads_of(*brick), static_cast<std::size_t>(std::popcount(brick->points))}};
    if (!node.exists()) return {};
    return {~std::uint64_t{0}, tree.occupied(node.log_odds()) ? ~std::uint64_t{0} : 0, {}};
  }

  /// Either covers this cube, or is a larger leaf.
  void compare(const Node& before, const Node& now, const Key3& corner, int level) {
    if (history_.same(before, now)) return;
    const bool divided = before.has_children() || now.has_children();
    if (divided && level > occupancy::VoxelTree::brick_level) {
      for (unsigned c = 0; c < 8; ++c)
        compare(before.has_children() ? before.child(c) : before, now.has_children() ? now.child(c) : now,
                child_corner(corner, c, level - 1), level - 1);
      return;
    }
    const Contents was = contents_of(before_, before), is = contents_of(now_, now);
    if (was.known != is.known || was.occupied != is.occupied ||
        !std::equal(was.payloads.begin(), was.payloads.end(), is.payloads.begin(), is.payloads.end()))
      visit_(corner_of(corner), level);
  }

  const occupancy::VoxelTree &before_, &now_;
  History history_;
  const Visit& visit_;
};

void require_same_resolution(const OccupancyView& a, const OccupancyView& b) {
  if (a.resolution() > 0 && b.resolution() > 0 && a.resolution() != b.resolution())
    throw Error(Error::Kind::usage, "before", "is a view of a map of another resolution");
}

const occupancy::VoxelTree& nothing() {
  static const occupancy::VoxelTree tree{occupancy::OccupancyModel{}};
  return tree;
}

}  // namespace

void OccupancyView::for_each_leaf(const VisitLeaves& visit) const {
  if (tree_ != nullptr) visit_leaves(*tree_, {}, visit);
}

void OccupancyView::for_each_leaf(const Eigen::AlignedBox3d& box, const VisitLeaves& visit) const {
  if (box.min().hasNaN() || box.max().hasNaN()) throw Error(Error::Kind::usage, "box", "is not a number");
  if (tree_ != nullptr && !box.isEmpty())
    visit_leaves(*tree_, occupancy::keys_that_meet(box, resolution_), visit);
}

void OccupancyView::for_each_change(const OccupancyView& before, const VisitChange& visit) const {
  if (tree_ == nullptr && before.tree_ == nullptr) return;
  require_same_resolution(*this, before);
  Comparison(before.tree_ != nullptr ? *before.tree_ : nothing(), tree_ != nullptr ? *tree_ : nothing(),
             visit);
}

void OccupancyView::for_each_changed_cube(
    const OccupancyView& before,
    const std::function<void(const std::array<std::uint16_t, 3>&, int)>& visit) const {
  if (tree_ == before.tree_) return;
  require_same_resolution(*this, before);
  StateComparison(before.tree_ != nullptr ? *before.tree_ : nothing(), tree_ != nullptr ? *tree_ : nothing(),
                  visit);
}

void occupancy::OccupancyMap::set_leaves(std::span<const Leaf> leaves) {
  for (const Leaf& leaf : leaves) {
    const unsigned inside = (1U << std::min<unsigned>(leaf.level, occupancy::VoxelTree::top_level)) - 1;
    if (leaf.level > occupancy::VoxelTree::top_level || !std::isfinite(leaf.log_odds) ||
        ((leaf.corner[0] | leaf.corner[1] | leaf.corner[2]) & inside) != 0)
      throw Error(Error::Kind::data, "octree",
                  "holds a leaf that no octree has: its corner, level or log-odds");
    tree_->set_leaf({leaf.corner[0], leaf.corner[1], leaf.corner[2]}, leaf.level, leaf.log_odds);
  }
}

}  // namespace octosurf
