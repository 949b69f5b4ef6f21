#include "law/contacts.hpp"

#include <cmath>
#include <utility>

namespace octosurf::law {
namespace {

using Index = Readings::Index;

/// Effort: lines looked at between two patches.
constexpr int most_lines = 32;
/// Effort: at a straight rim the mean of a reading's neighbours lies 0.6 voxels off it, inside a plane 0.1.
constexpr double rim_asymmetry = 0.25;

/// Looks for patches across gaps from the readings at rims.
class Gaps {
 public:
  Gaps(const Readings& readings, const std::vector<Label>& labels, double reach, const PatchGraph& graph)
      : readings_(readings),
        labels_(labels),
        reach_(reach),
        graph_(graph),
        at_rim_(readings.size()),
        settled_for_(graph.size(), Readings::none) {
    for (Index i = 0; i < readings.size(); ++i) at_rim_[i] = is_at_rim(i);
  }

  void look_around(Index i) {
    if (!at_rim_[i]) return;
    const int voxels = static_cast<int>(reach_ / readings_.resolution());
    readings_.for_each_near(readings_[i].key, voxels, [&](Index j) {
      const Label other = labels_[j];
      if (j <= i || other == clutter || other == labels_[i] || !at_rim_[j] || settled_for_[other] == i)
        return;
      const Eigen::Vector3d line = position(j) - position(i);
      if (line.squaredNorm() <= reach_ * reach_ && !look_along(i, j)) settled_for_[other] = i;
    });
  }

  void report(PatchGraph& graph) const {
    for (const auto& [pair, gap] : gaps_)
      if (2 * gap.open > gap.lines) graph.meet(pair.first, pair.second, gap.sum / gap.open, 0);
  }

 private:
  struct Gap {
    int lines = 0, open = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // of the open lines' middles
  };

  Eigen::Vector3d position(Index i) const { return readings_[i].position.cast<double>(); }

  /// Its neighbours of the same plane lie to one side of it.
  bool is_at_rim(Index i) const {
    if (labels_[i] == clutter) return false;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int same = 0;
    for (const Index j : readings_.near(i)) {
      if (labels_[j] != labels_[i]) continue;
      sum += position(j) - position(i);
      ++same;
    }
    const Eigen::Vector3d& normal = graph_[labels_[i]].plane.normal;
    return (sum - normal.dot(sum) * normal).norm() >= same * rim_asymmetry * readings_.resolution();
  }

  /// False if no further line from the one to the other's patch would tell more.
  bool look_along(Index i, Index j) {
    if (graph_.met(labels_[i], labels_[j])) return false;
    const Label a = std::min(labels_[i], labels_[j]), b = std::max(labels_[i], labels_[j]);
    const Patch &pa = graph_[a], &pb = graph_[b];
    if (pa.plane.normal.dot(pb.plane.normal) < 0.5) return false;  // as in PatchGraph::gain()
    Gap& gap = gaps_[{a, b}];
    const Eigen::Vector3d middle = 0.5 * (position(i) + position(j));
    if (gap.lines == most_lines) return false;
    if (!(log_same(pa, pb, middle) > 0)) return true;
    ++gap.lines;
    if (!open(i, j)) return true;
    ++gap.open;
    gap.sum += middle;
    return true;
  }

  bool open(Index i, Index j) const {
    const Reading& reading = readings_[i];
    const Plane& plane = graph_[labels_[i]].plane;
    const double above =
        readings_.model().reach(reading.range_class, reading.facing(plane)) + readings_.resolution();
    return open(i, j, Eigen::Vector3d::Zero()) && open(i, j, above * plane.normal);
  }

  /// Along the line between the two, moved by `lift`.
  bool open(Index i, Index j, const Eigen::Vector3d& lift) const {
    const Eigen::Vector3d from = position(i) + lift, line = position(j) - position(i);
    const int steps = static_cast<int>(2 * line.norm() / readings_.resolution());
    for (int k = 1; k < steps; ++k) {
      geometry::VoxelKey key;
      const Eigen::Vector3d at = from + line * (static_cast<double>(k) / steps);
      if (!readings_.grid().key_of(at.cast<float>(), key)) return false;
      const Index on_it = readings_.find(key);
      if (on_it == Readings::none) continue;
      if (labels_[on_it] != labels_[i] && labels_[on_it] != labels_[j]) return false;
    }
    return true;
  }

  const Readings& readings_;
  const std::vector<Label>& labels_;
  double reach_;
  const PatchGraph& graph_;
  std::vector<char> at_rim_;
  std::vector<Index> settled_for_;  // by label: the reading from which no line to it is looked along any more
  std::map<std::pair<Label, Label>, Gap> gaps_;
};

}  // namespace

void meet_neighbours(const Readings& readings, const std::vector<Label>& labels,
                     const std::vector<bool>& ambiguous, PatchGraph& graph) {
  for (Index i = 0; i < readings.size(); ++i) {
    if (labels[i] == clutter || ambiguous[i]) continue;
    for (const Index j : readings.near(i)) {
      if (labels[j] == clutter || labels[j] == labels[i] || ambiguous[j]) continue;
      const Eigen::Vector3f middle = 0.5F * (readings[i].position + readings[j].position);
      graph.meet(labels[i], labels[j], middle.cast<double>(), 0.5);  // each pair is seen from both ends
    }
  }
}

void meet_across_gaps(const Readings& readings, const std::vector<Label>& labels, double reach,
                      PatchGraph& graph) {
  Gaps gaps(readings, labels, reach, graph);
  for (Index i = 0; i < readings.size(); ++i) gaps.look_around(i);
  gaps.report(graph);
}

}  // namespace octosurf::law
