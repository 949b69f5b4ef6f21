#include "law/segment.hpp"

#include "geometry/plane_frame.hpp"
#include "law/contacts.hpp"
#include "law/curvature.hpp"
#include "law/labelling.hpp"
#include "law/patch_graph.hpp"
#include "law/planelets.hpp"

namespace octosurf {
namespace {

using Index = Readings::Index;

constexpr int rounds = 3;  // effort: the third moves one label in a hundred

void merge(const Readings& readings, double gap, Segmentation& segmentation) {
  const std::vector<bool> ambiguous = find_ambiguous(readings, segmentation.labels, segmentation.patches);
  PatchGraph graph(std::move(segmentation.patches));
  meet_neighbours(readings, segmentation.labels, ambiguous, graph);
  meet_across_gaps(readings, segmentation.labels, gap, graph);
  PatchGraph::Merged merged = std::move(graph).merge();
  for (Label& label : segmentation.labels) label = merged.into[label];
  segmentation.patches = std::move(merged.patches);
}

std::vector<std::vector<Index>> by_label(const Segmentation& segmentation) {
  std::vector<std::vector<Index>> of(segmentation.patches.size());
  for (Index i = 0; i < segmentation.labels.size(); ++i) of[segmentation.labels[i]].push_back(i);
  return of;
}

bool is_surface(const Readings& readings, const SegmentLimits& limits, const Patch& patch,
                const std::vector<Index>& indices) {
  if (indices.size() < limits.fewest_points) return false;
  double explained = 0;
  Moments extent;  // unweighted
  for (const Index i : indices) {
    explained += readings.log_ratio(i, patch.plane);
    extent.add(readings[i].position.cast<double>() - patch.origin);
  }
  return width_of(extent) >= limits.least_width && explained > description_cost(patch) &&
         !is_curved(readings, patch, indices);
}

/// What is no surface becomes clutter, unless a surface beside it explains it.
void accept(const Readings& readings, const SegmentLimits& limits, Segmentation& segmentation) {
  const std::vector<std::vector<Index>> of = by_label(segmentation);
  std::vector<Label> into(segmentation.patches.size(), clutter);
  std::vector<Patch> accepted(1);
  for (Label label = 1; label < segmentation.patches.size(); ++label) {
    if (!is_surface(readings, limits, segmentation.patches[label], of[label])) continue;
    into[label] = static_cast<Label>(accepted.size());
    accepted.push_back(segmentation.patches[label]);
  }
  for (Label& label : segmentation.labels) label = into[label];
  segmentation.patches = std::move(accepted);
}

}  // namespace

Segmentation segment(const Readings& readings, const SegmentLimits& limits) {
  Segmentation result;
  result.patches = find_planelets(readings, result.labels);
  for (int round = 0; round < rounds; ++round) {
    merge(readings, limits.gap, result);
    relabel(readings, result.patches, result.labels);
    result.patches = connected_pieces(readings, result.patches, result.labels);
  }
  merge(readings, limits.gap, result);
  accept(readings, limits, result);
  relabel(readings, result.patches, result.labels);
  refit_patches(readings, result.labels, result.patches);
  accept(readings, limits, result);
  return result;
}

}  // namespace octosurf
