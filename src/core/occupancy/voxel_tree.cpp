#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <atomic>

namespace octosurf::occupancy {

VoxelTree::VoxelTree(const OccupancyModel& occupancy_model) : model_(occupancy_model) {
  static std::atomic<std::uint64_t> histories{0};
  history_ = ++histories;
}

VoxelTree::Group& VoxelTree::divided(Slot& slot) {
  if (slot.link < first_link) {
    const std::uint32_t index = groups_.make();
    groups_.writable(index).fill(slot);  // a leaf represents eight equal children
    slot.link = first_link + index;
  }
  mark(slot, true);  // until it is closed
  return writable_group(slot);
}

VoxelTree::Brick& VoxelTree::brick_at(Slot& slot) {
  if (slot.link < first_link) {
    const std::uint32_t index = bricks_.make();
    if (slot.link == leaf) {
      Brick& made = bricks_.writable(index);
      made.value.fill(slot.value);
      made.known = whole;
    }
    slot.link = first_link + index;
  }
  mark(slot, true);  // until it is closed
  return writable_brick(slot);
}

VoxelTree::Brick& VoxelTree::brick_at(geometry::VoxelKey key) {
  Slot* slot = &root_;
  for (int level = top_level - 1; level >= brick_level; --level) slot = &divided(*slot)[child_of(key, level)];
  return brick_at(*slot);
}

void VoxelTree::close(Slot& slot) {
  const Group& children = group(slot);
  const Slot first = children[0];
  const auto same = [&first](const Slot& child) { return child.link == leaf && child.value == first.value; };
  if (std::all_of(children.begin(), children.end(), same)) {
    groups_.release(slot.link - first_link);
    slot = first;
    return;
  }
  mark(slot, std::any_of(children.begin(), children.end(),
                         [this](const Slot& child) { return may_be_occupied(child); }));
}

void VoxelTree::close_brick(Slot& slot) {
  const Brick& b = brick(slot);
  mark(slot, b.points != 0 || occupied_without_points());
  if (b.known != whole || b.points != 0) return;
  const float value = b.value[0];
  if (std::any_of(b.value.begin(), b.value.end(), [&](float v) { return v != value; })) return;
  bricks_.release(slot.link - first_link);
  slot = {leaf, value};
}

void VoxelTree::forget(Slot& slot, int level) {
  if (slot.link >= first_link && level > brick_level) {
    for (Slot& child : writable_group(slot)) forget(child, level - 1);
    groups_.release(slot.link - first_link);
  } else if (slot.link >= first_link) {
    payloads_.release(writable_brick(slot).payloads);
    bricks_.release(slot.link - first_link);
  }
  slot = {};
}

VoxelPayload& VoxelTree::payload(Brick& b, unsigned i) {
  const unsigned rank = b.rank(i);
  const std::uint64_t bit = std::uint64_t{1} << i;
  if ((b.points & bit) != 0) return payloads_.writable(b.payloads)[rank];
  VoxelPayload& made = payloads_.insert(b.payloads, rank, geometry::bit_count(b.points));
  b.points |= bit;
  return made;
}

VoxelPayload& VoxelTree::make_payload(geometry::VoxelKey key) {
  return payload(brick_at(key), index_in_brick(key));
}

VoxelTree::Lookup VoxelTree::find(geometry::VoxelKey key) const {
  const Slot* slot = &root_;
  int level = top_level;
  while (slot->link >= first_link && level > brick_level) slot = &group(*slot)[child_of(key, --level)];
  if (slot->link < first_link) return {slot->link == leaf, slot->value, level, nullptr};
  const Brick& b = brick(*slot);
  const unsigned i = index_in_brick(key);
  Lookup found{(b.known >> i & 1) != 0, b.value[i], 0, nullptr};
  if ((b.points >> i & 1) != 0) {
    found.place = {b.payloads, static_cast<std::uint8_t>(b.rank(i))};
    found.payload = payloads_.at(b.payloads) + found.place.rank;
  }
  return found;
}

void VoxelTree::set_leaf(geometry::VoxelKey corner, int level, float log_odds) {
  expect_leaves();
  Slot* slot = &root_;
  for (int l = top_level - 1; l >= std::max(level, brick_level); --l)
    slot = &divided(*slot)[child_of(corner, l)];
  if (level >= brick_level) {
    forget(*slot, level);
    *slot = {leaf, log_odds};
    return;
  }
  set_leaf(brick_at(*slot), corner, level, log_odds);
}

void VoxelTree::set_leaf(Brick& b, geometry::VoxelKey corner, int level, float log_odds) {
  const unsigned first = index_in_brick(corner);
  for (unsigned i = first; i < first + (1U << (3 * level)); ++i) {
    b.value[i] = log_odds;
    b.known |= std::uint64_t{1} << i;
  }
}

// Marks nodes that may be occupied, and checks whether any of those voxels has no point.
void VoxelTree::settle(Slot& slot, int level) {
  if (slot.link < first_link) {
    without_points_ = without_points_ || may_be_occupied(slot);
    return;
  }
  bool any = false;
  if (level > brick_level) {
    for (Slot& child : writable_group(slot)) {
      settle(child, level - 1);
      any = any || may_be_occupied(child);
    }
  } else {
    const Brick& b = brick(slot);
    any = b.points != 0;
    for (std::uint64_t m = b.known & ~b.points; m != 0; m &= m - 1)
      if (occupied(b.value[static_cast<std::size_t>(std::countr_zero(m))])) any = without_points_ = true;
  }
  mark(slot, any);
}

// A brick's points may be assigned without a write to its voxels.
void VoxelTree::mark_way_to(geometry::VoxelKey brick) {
  Slot* slot = &root_;
  for (int level = top_level; slot->link >= first_link; --level) {
    if (std::bit_cast<std::uint32_t>(slot->value) >> 1 != shares_) mark(*slot, may_be_occupied(*slot));
    if (level == brick_level) return;
    slot = &writable_group(*slot)[child_of(brick, level - 1)];
  }
}

void VoxelTree::mark_assigned() {
  std::sort(assigned_.begin(), assigned_.end());
  assigned_.erase(std::unique(assigned_.begin(), assigned_.end()), assigned_.end());
  for (const std::uint64_t brick : assigned_) mark_way_to(key_of(brick << (3 * brick_level)));
  assigned_.clear();
}

std::shared_ptr<const VoxelTree> VoxelTree::share() {
  mark_assigned();
  if (!settled_) {
    without_points_ = false;
    settle(root_, top_level);
    settled_ = true;
  }
  const auto copy = std::make_shared<VoxelTree>(model_);
  copy->history_ = history_;
  copy->shares_ = shares_++;
  copy->without_points_ = without_points_;
  copy->root_ = root_;
  copy->numbers = numbers;
  copy->groups_ = groups_.share();
  copy->bricks_ = bricks_.share();
  copy->payloads_ = payloads_.share();
  return copy;
}

void VoxelTree::begin_changes() {
  if (assigned_.size() > bricks_.size()) mark_assigned();  // it may be long until the next share
  groups_.begin_changes();
  bricks_.begin_changes();
  payloads_.begin_changes();
  root_before_ = root_;
  numbers_before_ = numbers;
}

void VoxelTree::commit() noexcept {
  groups_.commit();
  bricks_.commit();
  payloads_.commit();
}

void VoxelTree::roll_back() noexcept {
  groups_.roll_back();
  bricks_.roll_back();
  payloads_.roll_back();
  root_ = root_before_;
  numbers = numbers_before_;
}

VoxelTree::Node VoxelTree::root() const {
  Node node;
  node.tree_ = this;
  node.slot_ = &root_;
  return node;
}

bool VoxelTree::Node::has_children() const {
  if (brick_ == nullptr) return slot_->link >= first_link;
  if (level_ == 0) return false;
  // Eight voxels: undivided if all are known, equal and without points.
  const std::uint64_t eight = std::uint64_t{0xff} << first_;
  if ((brick_->known & eight) == 0) return false;
  if ((brick_->known & eight) != eight || (brick_->points & eight) != 0) return true;
  const float* v = brick_->value.data() + first_;
  return std::any_of(v, v + 8, [&](float other) { return other != *v; });
}

VoxelTree::Node VoxelTree::Node::child(unsigned c) const {
  Node node = *this;
  node.level_ = level_ - 1;
  if (level_ > brick_level) {
    node.slot_ = &tree_->group(*slot_)[c];
  } else {
    if (level_ == brick_level) node.brick_ = &tree_->brick(*slot_);
    node.first_ = first_ + (c << (3 * node.level_));
  }
  return node;
}

const VoxelPayload* VoxelTree::Node::payload() const {
  if (brick_ == nullptr || level_ != 0 || (brick_->points >> first_ & 1) == 0) return nullptr;
  return tree_->payloads_.at(brick_->payloads) + brick_->rank(first_);
}

}  // namespace octosurf::occupancy
