#include "detection/contacts.hpp"

#include "detection/clear_way.hpp"
#include "detection/constants.hpp"
#include "detection/label_blocks.hpp"

#include <optional>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

/// Effort: lines evaluated between two patches.
constexpr int most_lines = 32;
/// Effort: at a straight boundary a reading's neighbours lie 0.6 voxels to one side of it, inside a plane
/// 0.1.
constexpr double boundary_asymmetry = 0.25;

/// Searches for patches across gaps, from the readings at boundaries.
class Gaps {
 public:
  Gaps(const Readings& readings, const std::vector<Label>& labels, const Junctions& junctions, double reach,
       const PatchGraph& graph)
      : readings_(readings), labels_(labels), junctions_(junctions), reach_(reach), graph_(graph) {}

  void look() {
    std::vector<bool> at_boundary(readings_.size());
    for (Index i = 0; i < readings_.size(); ++i) at_boundary[i] = is_at_boundary(i);
    const LabelBlocks blocks(readings_, labels_, at_boundary);
    blocks.for_each_group(
        voxels(), [](const auto&) { return true; },
        [&](const LabelBlocks::Group& group, const std::vector<const LabelBlocks::Block*>& near) {
          for (const LabelBlocks::Block* block : near) look_from(group, *block);
        });
  }

  void report(PatchGraph& graph) const {
    for (const Gap& gap : gaps_)
      if (2 * gap.open > gap.lines) graph.meet(gap.a, gap.b, gap.sum / gap.open, 0);
  }

 private:
  struct Gap {
    Label a, b;
    std::optional<PlanePair> planes;  // empty if no lines are to be evaluated
    int lines = 0, open = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of the open lines' middles
    bool goes_on() const { return planes && lines < most_lines; }
  };

  Eigen::Vector3d position(Index i) const { return readings_[i].position.cast<double>(); }
  int voxels() const { return static_cast<int>(reach_ / readings_.resolution()); }

  /// Its neighbours on the same plane lie to one side of it.
  bool is_at_boundary(Index i) const {
    if (labels_[i] == clutter) return false;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int same = 0;
    for (const Index j : readings_.near(i)) {
      if (labels_[j] != labels_[i]) continue;
      sum += position(j) - position(i);
      ++same;
    }
    const Eigen::Vector3d& normal = graph_[labels_[i]].plane.normal;
    return (sum - normal.dot(sum) * normal).norm() >= same * boundary_asymmetry * readings_.resolution();
  }

  void look_from(const LabelBlocks::Group& group, const LabelBlocks::Block& block) {
    for (const LabelBlocks::Group& other : block.groups) {
      if (other.label == group.label || other.members.back() <= group.members.front()) continue;
      Gap& gap = gap_between(group.label, other.label);
      for (auto i = group.members.begin(); i != group.members.end() && gap.goes_on(); ++i)
        LabelBlocks::for_each_of(other, block.within(readings_[*i].key, voxels()), [&](Index j) {
          if (j > *i && (position(j) - position(*i)).squaredNorm() <= reach_ * reach_) look_along(*i, j, gap);
        });
    }
  }

  Gap& gap_between(Label a, Label b) {
    if (a > b) std::swap(a, b);
    const auto [at, fresh] = index_.try_emplace(std::uint64_t{a} << 32 | b, gaps_.size());
    if (fresh) {
      gaps_.push_back({.a = a, .b = b, .planes = {}});
      const bool alike = graph_[a].plane.normal.dot(graph_[b].plane.normal) >= Constants::least_cosine;
      if (alike && !graph_.met(a, b)) gaps_.back().planes.emplace(graph_[a], graph_[b]);
    }
    return gaps_[at->second];
  }

  void look_along(Index i, Index j, Gap& gap) const {
    const Eigen::Vector3d middle = 0.5 * (position(i) + position(j));
    if (!gap.goes_on() || !(gap.planes->log_same(middle) > 0)) return;
    ++gap.lines;
    if (junctions_.separated_by_plane(i, j) || !open(i, j)) return;
    ++gap.open;
    gap.sum += middle;
  }

  bool open(Index i, Index j) const {
    const Reading& reading = readings_[i];
    const Plane& plane = graph_[labels_[i]].plane;
    const double above =
        readings_.model().reach(reading.range_class, reading.cos_incidence(plane)) + readings_.resolution();
    return is_clear_way(
        readings_.grid(), position(i), position(j), above * plane.normal, [&](geometry::VoxelKey key) {
          const Index on_it = readings_.find(key);
          return on_it != Readings::none && labels_[on_it] != labels_[i] && labels_[on_it] != labels_[j];
        });
  }

  const Readings& readings_;
  const std::vector<Label>& labels_;
  const Junctions& junctions_;
  double reach_;
  const PatchGraph& graph_;
  std::vector<Gap> gaps_;                                                      // in order of discovery
  tsl::robin_map<std::uint64_t, std::size_t, geometry::PackedKeyHash> index_;  // of them, by their labels
};

}  // namespace

void meet_neighbours(const Readings& readings, const std::vector<Label>& labels, const Junctions& junctions,
                     PatchGraph& graph) {
  for (const Index i : junctions.contacts()) {
    if (readings.is_context(i)) break;
    if (labels[i] == clutter || junctions.ambiguous(i)) continue;
    for (const Index j : readings.near(i)) {
      if (labels[j] == clutter || labels[j] == labels[i]) continue;
      if (junctions.ambiguous(j) || junctions.separated_by_plane(i, j)) continue;
      const Eigen::Vector3f middle = 0.5F * (readings[i].position + readings[j].position);
      const double pair = readings.is_context(j) ? 1 : 0.5;  // otherwise the pair is counted from both sides
      graph.meet(labels[i], labels[j], middle.cast<double>(), pair);
    }
  }
}

void meet_across_gaps(const Readings& readings, const std::vector<Label>& labels, const Junctions& junctions,
                      double reach, PatchGraph& graph) {
  Gaps gaps(readings, labels, junctions, reach, graph);
  gaps.look();
  gaps.report(graph);
}

}  // namespace octosurf::detection
