#include "detection/labelling.hpp"

#include "detection/constants.hpp"
#include "detection/neighbour_labels.hpp"
#include "geometry/disjoint_sets.hpp"

#include <algorithm>
#include <iterator>
#include <map>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

constexpr int most_sweeps = 8;  // effort: nearly all labels are stable after three

Label best_label(const Readings& readings, const std::vector<Patch>& patches,
                 const std::vector<Label>& labels, Index i) {
  const Label own = labels[i];
  const std::span<const Index> around = readings.near(i);
  const auto other = std::find_if(around.begin(), around.end(), [&](Index j) { return labels[j] != own; });
  const auto agreeing = static_cast<int>(other - around.begin());
  if (other == around.end()) {  // inside a surface: shortcut of the code below
    if (own == clutter) return clutter;
    const double gain = readings.log_ratio(i, patches[own].plane) + Constants::boundary_cost * agreeing;
    return gain > 0 ? own : clutter;
  }
  NeighbourLabels near;
  near.add(own, agreeing);  // it may keep a label that no neighbour has
  std::for_each(other, around.end(), [&](Index j) { near.add(labels[j]); });
  return near.best([&](Label label) { return readings.log_ratio(i, patches[label].plane); });
}

/// Connects neighbouring readings that no plane separates. Those at the border are connected with the part
/// outside of the same label, and so with each other.
geometry::DisjointSets join_neighbours(const Readings& readings, const Segmentation& segmentation,
                                       const Junctions& junctions) {
  const std::vector<Label>& labels = segmentation.labels;
  std::vector<Index> at_border(segmentation.patches.size(), Readings::none);  // one for each label
  std::vector<bool> goes_on(segmentation.patches.size(), false);
  for (const Outside& outside : segmentation.outside) goes_on[outside.label] = true;
  geometry::DisjointSets sets(readings.size_with_context());
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    if (labels[i] == clutter || junctions.ambiguous(i)) continue;
    if (!readings.is_context(i)) {
      for (const Index j : readings.near(i))
        if (labels[j] == labels[i] && !junctions.ambiguous(j) && !junctions.separated_by_plane(i, j))
          sets.join(i, j);
    }
    if (!goes_on[labels[i]] || !readings.at_border(i)) continue;
    Index& first = at_border[labels[i]];
    first == Readings::none ? void(first = i) : sets.join(first, i);
  }
  return sets;
}

/// Root of each reading's piece; an ambiguous reading joins the piece of most of its neighbours.
std::vector<std::size_t> roots_of_pieces(const Readings& readings, const Segmentation& segmentation,
                                         const Junctions& junctions) {
  const std::vector<Label>& labels = segmentation.labels;
  geometry::DisjointSets sets = join_neighbours(readings, segmentation, junctions);
  std::vector<std::size_t> roots(readings.size_with_context());
  for (Index i = 0; i < roots.size(); ++i) roots[i] = sets.root(i);
  for (Index i = 0; i < readings.size(); ++i) {
    if (!junctions.ambiguous(i)) continue;
    NeighbourLabels pieces;  // by root
    for (const Index j : readings.near(i))
      if (labels[j] == labels[i] && !junctions.ambiguous(j)) pieces.add(static_cast<Label>(roots[j]));
    int most = 0;
    for (const auto& [root, agreeing] : pieces) {
      if (agreeing <= most) continue;
      most = agreeing;
      roots[i] = root;
    }
  }
  return roots;
}

}  // namespace

void relabel(const Readings& readings, const std::vector<Patch>& patches, std::vector<Label>& labels) {
  std::vector<bool> ask(readings.size_with_context());
  for (Index i = 0; i < readings.size(); ++i) ask[i] = !readings.at_border(i);
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    std::vector<bool> ask_again(ask.size(), false);
    bool changed = false;
    for (Index i = 0; i < readings.size(); ++i) {
      if (!ask[i]) continue;
      const Label best = best_label(readings, patches, labels, i);
      if (best == labels[i]) continue;
      labels[i] = best;
      changed = true;
      for (const Index j : readings.near(i)) ask_again[j] = !readings.at_border(j);
    }
    if (!changed) return;
    ask = std::move(ask_again);
  }
}

namespace {

/// Initialises pieces with the sums outside of each label, by the root of the connected piece, if any.
void begin_with_outside(const Readings& readings, const Junctions& junctions,
                        const std::vector<std::size_t>& roots, const std::vector<std::size_t>& sizes,
                        Segmentation& segmentation, std::vector<Patch>& pieces, std::vector<Label>& of_root) {
  constexpr std::size_t nothing = ~std::size_t{0};
  std::vector<std::size_t> root_of(segmentation.patches.size(), nothing);
  for (Index i = 0; i < readings.size_with_context(); ++i)
    if (readings.at_border(i) && !junctions.ambiguous(i)) root_of[segmentation.labels[i]] = roots[i];
  std::map<Label, Label> piece_of;
  for (Outside& outside : segmentation.outside) {
    if (outside.label == clutter) continue;
    const std::size_t root = root_of[outside.label];
    Label& piece = piece_of[outside.label];
    if (piece == clutter && outside.sums.readings + static_cast<double>(root == nothing ? 0 : sizes[root]) >=
                                Constants::fewest_of_plane) {
      piece = static_cast<Label>(pieces.size());
      pieces.push_back(segmentation.patches[outside.label]);
      if (root != nothing) of_root[root] = piece;
    }
    outside.label = piece;
  }
}

}  // namespace

void part_into_pieces(const Readings& readings, const Junctions& junctions, Segmentation& segmentation) {
  std::vector<Label>& labels = segmentation.labels;
  const std::vector<std::size_t> roots = roots_of_pieces(readings, segmentation, junctions);
  std::vector<std::size_t> sizes(roots.size(), 0);
  for (Index i = 0; i < readings.size(); ++i)
    if (labels[i] != clutter) ++sizes[roots[i]];
  std::vector<Label> of_root(roots.size(), clutter);
  std::vector<Patch> pieces(1);
  begin_with_outside(readings, junctions, roots, sizes, segmentation, pieces, of_root);
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    if (labels[i] == clutter) continue;
    Label& piece = of_root[roots[i]];
    if (piece == clutter) {
      if (sizes[roots[i]] < Constants::fewest_of_plane) {
        labels[i] = clutter;
        continue;
      }
      piece = static_cast<Label>(pieces.size());
      pieces.push_back(segmentation.patches[labels[i]]);
    }
    labels[i] = piece;
  }
  segmentation.patches = std::move(pieces);
  refit_patches(readings, junctions, segmentation);
}

void refit_patches(const Readings& readings, const Junctions& junctions, Segmentation& segmentation) {
  std::vector<Patch>& patches = segmentation.patches;
  const std::vector<std::vector<Index>> of = segmentation.by_label(readings.size());
  const std::vector<Patch> outside = sums_outside(segmentation);
  for (Label label = 1; label < patches.size(); ++label) {
    std::vector<Index> clear;
    std::copy_if(of[label].begin(), of[label].end(), std::back_inserter(clear),
                 [&](Index i) { return !junctions.ambiguous(i); });
    const auto readings_with = [&](const std::vector<Index>& indices) {
      return static_cast<double>(indices.size()) + outside[label].readings;
    };
    const std::vector<Index>& fitted = readings_with(clear) < Constants::fewest_of_plane ? of[label] : clear;
    if (readings_with(fitted) >= Constants::fewest_of_plane)
      patches[label] = readings.patch_of(fitted, patches[label].plane, outside[label]);
  }
}

}  // namespace octosurf::detection
