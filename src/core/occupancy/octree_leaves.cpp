// Reads and writes the octree leaf by leaf, to build and update another octree.
#include "occupancy/nearest_voxel.hpp"
#include "occupancy/occupancy_map.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
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

  /// True if the node is one leaf, which is now the last one.
  bool collect(const Node& node, const Key3& corner) {
    if (!node.exists() || !range_.meets(KeyBox::cube(corner, node.level()))) return false;
    if (const occupancy::VoxelTree::Brick* brick = node.brick()) return in_brick(*brick, corner);
    if (!node.has_children()) {
      add(corner, node.level(), node.log_odds());
      return true;
    }
    bool all = true;
    for (unsigned c = 0; c < 8; ++c)
      all = collect(node.child(c), child_corner(corner, c, node.level() - 1)) && all;
    if (all && merge(corner, node.level())) return true;
    // No ancestor is a single leaf either, so the collected leaves are final.
    constexpr std::size_t enough = 4096;
    if (visit_ != nullptr && leaves_.size() >= enough) hand_on();
    return false;
  }

  bool collect_octet(const occupancy::VoxelTree::Brick& brick, unsigned octet, const Key3& corner) {
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

  void hand_on() {
    if (!leaves_.empty()) (*visit_)(leaves_);
    leaves_.clear();
  }

 private:
  bool in_brick(const occupancy::VoxelTree::Brick& brick, const Key3& corner) {
    bool all = true;
    for (unsigned octet = 0; octet < 8; ++octet)
      all = collect_octet(brick, octet, child_corner(corner, octet, 1)) && all;
    return all && merge(corner, occupancy::VoxelTree::brick_level);
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

/// Where two trees were shared from one, unchanged nodes need no comparison.
class History {
 public:
  History(const occupancy::VoxelTree& before, const occupancy::VoxelTree& now)
      : related_(now.history() == before.history()),
        forward_(now.shares() >= before.shares()),
        shares_(std::min(before.shares(), now.shares())) {}

  bool same(const Node& before, const Node& now) const {
    return related_ && !(forward_ ? now : before).written_since(shares_);
  }

 private:
  bool related_, forward_;  // forward: `now` is the later one
  std::uint32_t shares_;    // before the earlier of the two
};

using Brick = occupancy::VoxelTree::Brick;
using Corner = std::array<std::uint16_t, 3>;

/// A leaf represents eight equal children.
Node part_of(const Node& node, unsigned c) { return node.has_children() ? node.child(c) : node; }

/// Walks two trees side by side, where they may differ: `goes_on(before, now, corner, level)` of each cube
/// says whether to go on into its eighths. Either node covers this cube, or is a larger leaf.
template <class GoesOn>
void walk_both(const History& history, const Node& before, const Node& now, const Key3& corner, int level,
               const GoesOn& goes_on) {
  if (history.same(before, now) || !goes_on(before, now, corner, level)) return;
  for (unsigned c = 0; c < 8; ++c)
    walk_both(history, part_of(before, c), part_of(now, c), child_corner(corner, c, level - 1), level - 1,
              goes_on);
}
template <class GoesOn>
void walk_both(const occupancy::VoxelTree& before, const occupancy::VoxelTree& now, const GoesOn& goes_on) {
  walk_both(History(before, now), before.root(), now.root(), {0, 0, 0}, occupancy::VoxelTree::top_level,
            goes_on);
}

/// The octets, as a mask, in which a brick's log-odds are not those of the node that was there.
unsigned changed_octets(const Node& before, const Brick& is) {
  const Brick* was = before.brick();
  // A write copies a whole chunk, so most of its nodes are equal: a bitwise comparison is fast.
  if (was == &is || (was != nullptr && was->known == is.known &&
                     std::memcmp(was->value.data(), is.value.data(), sizeof is.value) == 0))
    return 0;
  unsigned octets = 0;
  for (unsigned i = 0; i < 64; ++i) {
    const bool was_known = was == nullptr || (was->known >> i & 1) != 0;
    const float was_value = was == nullptr ? before.log_odds() : was->value[i];
    if (was_known != ((is.known >> i & 1) != 0) || was_value != is.value[i]) octets |= 1U << i / 8;
  }
  return octets;
}

/// What a cube's voxels are: of a brick, or all alike.
struct Contents {
  std::uint64_t known = 0, occupied = 0;
  std::span<const occupancy::VoxelPayload> payloads{};
  const occupancy::SurfaceNumbers& numbers;

  Contents(const occupancy::VoxelTree& tree, const Node& node) : numbers(tree.numbers) {
    if (const Brick* brick = node.brick()) {
      known = brick->known;
      occupied = occupied_in(tree, *brick);
      payloads = {tree.payloads_of(*brick), static_cast<std::size_t>(std::popcount(brick->points))};
    } else if (node.exists()) {
      known = ~std::uint64_t{0};
      occupied = tree.occupied(node.log_odds()) ? known : 0;
    }
  }
  bool operator==(const Contents& other) const {
    const auto same = [&](const occupancy::VoxelPayload& a, const occupancy::VoxelPayload& b) {
      return a == b && numbers.id(a.surface) == other.numbers.id(b.surface);
    };
    return known == other.known && occupied == other.occupied &&
           std::ranges::equal(payloads, other.payloads, same);
  }
};

void require_same_resolution(const OccupancyView& a, const OccupancyView& b) {
  if (a.resolution() > 0 && b.resolution() > 0 && a.resolution() != b.resolution())
    throw Error(Error::Kind::usage, "before", "is a view of a map of another resolution");
}

const occupancy::VoxelTree& tree_of(const OccupancyView& view) {
  static const occupancy::VoxelTree nothing{occupancy::OccupancyModel{}};
  return view.tree() != nullptr ? *view.tree() : nothing;
}

/// All leaves of a tree in a range.
void visit_leaves(const occupancy::VoxelTree& tree, const KeyBox& range,
                  const OccupancyView::VisitLeaves& visit) {
  std::vector<Leaf> leaves;
  LeafCollector collector(range, leaves, &visit);
  collector.collect(tree.root(), {0, 0, 0});
  collector.hand_on();
}

}  // namespace

void OccupancyView::for_each_leaf(const VisitLeaves& visit) const {
  if (tree_ != nullptr) visit_leaves(*tree_, {}, visit);
}

void OccupancyView::for_each_leaf(const Eigen::AlignedBox3d& box, const VisitLeaves& visit) const {
  occupancy::require_box(box);
  if (tree_ != nullptr && !box.isEmpty())
    visit_leaves(*tree_, occupancy::keys_that_meet(box, resolution_), visit);
}

void OccupancyView::for_each_change(const OccupancyView& before, const VisitChange& visit) const {
  if (tree_ == nullptr && before.tree_ == nullptr) return;
  require_same_resolution(*this, before);
  std::vector<Leaf> leaves;
  LeafCollector collector(KeyBox{}, leaves, nullptr);
  const auto goes_on = [&](const Node& was, const Node& is, const Key3& corner, int level) {
    if (!is.has_children() || !was.exists()) {
      if (was.has_children() || was.exists() != is.exists() ||
          (is.exists() && was.log_odds() != is.log_odds())) {
        leaves.clear();
        collector.collect(is, corner);
        visit(corner_of(corner), static_cast<std::uint8_t>(level), leaves);
      }
      return false;
    }
    const Brick* brick = is.brick();
    if (brick == nullptr) return true;
    const unsigned changed = changed_octets(was, *brick);
    for (unsigned octet = 0; octet < 8; ++octet) {
      if ((changed >> octet & 1) == 0) continue;
      const Key3 at = child_corner(corner, octet, 1);
      leaves.clear();
      collector.collect_octet(*brick, octet, at);
      visit(corner_of(at), 1, leaves);
    }
    return false;
  };
  walk_both(tree_of(before), tree_of(*this), goes_on);
}

void OccupancyView::for_each_changed_cube(
    const OccupancyView& before, const std::function<void(const Corner& corner, int level)>& visit) const {
  if (tree_ == before.tree_) return;
  require_same_resolution(*this, before);
  const occupancy::VoxelTree &then = tree_of(before), &now = tree_of(*this);
  walk_both(then, now, [&](const Node& was, const Node& is, const Key3& corner, int level) {
    if ((was.has_children() || is.has_children()) && level > occupancy::VoxelTree::brick_level) return true;
    if (!(Contents(then, was) == Contents(now, is))) visit(corner_of(corner), level);
    return false;
  });
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
