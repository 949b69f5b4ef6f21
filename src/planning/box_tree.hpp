#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace octosurf::planning {

/// A bounding-box hierarchy: a binary tree, halved along the longer axis. Built in O(n log n).
class BoxTree {
 public:
  explicit BoxTree(std::vector<Eigen::AlignedBox3d> boxes = {}) : boxes_(std::move(boxes)) {
    order_.resize(boxes_.size());
    std::iota(order_.begin(), order_.end(), 0U);
    nodes_.reserve(boxes_.size());
    if (!boxes_.empty()) build(0, boxes_.size());
  }

  /// visit(index) in about the order of distance(box), up to `limit`, which visit() may lower. distance() of
  /// an enclosing box must not be larger.
  template <class Distance, class Visit>
  void nearest_first(const Distance& distance, const double& limit, const Visit& visit) const {
    if (!nodes_.empty() && distance(nodes_[0].box) <= limit) approach(0, distance, limit, visit);
  }

 private:
  static constexpr std::size_t leaf_size = 4;
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t first = 0, count = 0;  // of order_; 0: inner
    std::uint32_t second_child = 0;      // of nodes_; the first one follows
  };

  std::uint32_t build(std::size_t first, std::size_t last) {
    const auto at = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    Eigen::AlignedBox3d box, middles;
    for (std::size_t i = first; i < last; ++i) {
      box.extend(boxes_[order_[i]]);
      middles.extend(boxes_[order_[i]].center());
    }
    nodes_[at].box = box;
    if (last - first <= leaf_size) {
      nodes_[at].first = static_cast<std::uint32_t>(first);
      nodes_[at].count = static_cast<std::uint32_t>(last - first);
      return at;
    }
    Eigen::Index axis = 0;
    middles.sizes().maxCoeff(&axis);
    const std::size_t half = first + (last - first) / 2;
    const auto place = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(place(first), place(half), place(last), [&](std::uint32_t a, std::uint32_t b) {
      return std::make_pair(boxes_[a].center()[axis], a) < std::make_pair(boxes_[b].center()[axis], b);
    });
    build(first, half);
    const std::uint32_t second = build(half, last);
    nodes_[at].second_child = second;
    return at;
  }

  template <class Distance, class Visit>
  void approach(std::uint32_t at, const Distance& distance, const double& limit, const Visit& visit) const {
    const Node& node = nodes_[at];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      if (distance(boxes_[order_[i]]) <= limit) visit(std::size_t{order_[i]});
    if (node.count > 0) return;
    std::pair<double, std::uint32_t> near{distance(nodes_[at + 1].box), at + 1},
        far{distance(nodes_[node.second_child].box), node.second_child};
    if (far < near) std::swap(near, far);
    if (near.first <= limit) approach(near.second, distance, limit, visit);
    if (far.first <= limit) approach(far.second, distance, limit, visit);
  }

  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace octosurf::planning
