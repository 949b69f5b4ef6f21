#include "surfaces/atomic_shared_ptr.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <utility>

#include <octosurf/adapters/octomap_follower.hpp>
#include <octosurf/adapters/octree.hpp>

namespace octosurf {

struct OctomapFollower::State {
  struct Tree {
    std::unique_ptr<octomap::OcTree> octree;
    OccupancyView of;
    std::uint64_t number = 0;  ///< of the follow() that wrote it
    /// By readers; it may be written after the last of them released it. use_count() does not suffice: it
    /// does not order their reads before our writes.
    std::atomic<bool> held{false};
  };
  /// The tree to write: the latest one without readers, else a new one, else the oldest, which stays with its
  /// readers.
  std::shared_ptr<Tree>& next() {
    const auto rank = [](const std::shared_ptr<Tree>& tree) {
      if (!tree) return std::pair(1, std::uint64_t{0});
      const bool held = tree->held.load(std::memory_order_acquire);
      return held ? std::pair(2, tree->number) : std::pair(0, ~tree->number);
    };
    return *std::ranges::min_element(trees, {}, rank);
  }

  std::array<std::shared_ptr<Tree>, 3> trees;
  std::uint64_t follows = 0;
  surfaces::AtomicSharedPtr<const octomap::OcTree> shown{nullptr};
};

OctomapFollower::OctomapFollower() : state_(std::make_unique<State>()) {}
OctomapFollower::OctomapFollower(OctomapFollower&&) noexcept = default;
OctomapFollower& OctomapFollower::operator=(OctomapFollower&&) noexcept = default;
OctomapFollower::~OctomapFollower() = default;

std::shared_ptr<const octomap::OcTree> OctomapFollower::follow(const OccupancyView& now) {
  std::shared_ptr<State::Tree>& tree = state_->next();
  if (tree && !tree->held && tree->octree->getResolution() == now.resolution()) {
    try {
      update_octree(*tree->octree, tree->of, now);
    } catch (...) {
      tree.reset();  // partially changed
      throw;
    }
  } else {
    auto made = std::make_shared<State::Tree>();
    made->octree = to_octree(now);
    tree = std::move(made);
  }
  tree->of = now;
  tree->number = ++state_->follows;
  tree->held.store(true, std::memory_order_relaxed);
  std::shared_ptr<const octomap::OcTree> shown(tree->octree.get(), [tree](const octomap::OcTree*) {
    tree->held.store(false, std::memory_order_release);
  });
  state_->shown.store(shown);
  return shown;
}

std::shared_ptr<const octomap::OcTree> OctomapFollower::tree() const { return state_->shown.load(); }

}  // namespace octosurf
