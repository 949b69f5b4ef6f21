#include "detection/segment.hpp"

#include "detection/contacts.hpp"
#include "detection/crossings.hpp"
#include "detection/curvature.hpp"
#include "detection/junctions.hpp"
#include "detection/label_blocks.hpp"
#include "detection/labelling.hpp"
#include "detection/patch_graph.hpp"
#include "detection/seed_patches.hpp"
#include "geometry/local_width.hpp"
#include "geometry/plane_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

constexpr int rounds = 3;  // effort: merge and relabel, which may split patches again
/// Effort: a round that changes one reading in so many was the last one.
constexpr std::size_t settled_share = 1000;
/// Effort: shapes are judged again where one reading in so many came or went.
constexpr std::size_t judged_share = 10;
/// Effort: places where a patch's width is measured; of 100 the median is off by an eighth of their spread.
constexpr std::size_t width_places = 100;

/// `gap`: m, over which patches may merge; 0: touching ones only.
void merge(const Readings& readings, double gap, const Junctions& junctions, Segmentation& segmentation) {
  PatchGraph graph(std::move(segmentation.patches));
  meet_neighbours(readings, segmentation.labels, junctions, graph);
  if (gap > 0) meet_across_gaps(readings, segmentation.labels, junctions, gap, graph);
  PatchGraph::Merged merged = std::move(graph).merge();
  segmentation.follow(merged.into, std::move(merged.patches));
}

/// Gaps, at most h wide, between the lines of a plane that scan lines show. Rings of a spinning laser are up
/// to 1.4° from one to the next, 12 cm at 5 m, and h is 8 cm or more; a wider search meets the next corner.
constexpr int gaps_between_lines = 2;

/// m, of strips such as a ladder's front; infinite if unknown. A scan line is no wider than its readings'
/// spacing, on a floor as on a wall, whose level lines at corners are no plane: lines count as wide only
/// where others are near them. Noise along the lines of sight widens no line, however often it is seen: a
/// reading lies where its line of sight crosses the plane, as exactly as the stored view tells.
double width_in_most_places(const Readings& readings, const SegmentLimits& limits, const Patch& patch,
                            const std::vector<Index>& indices) {
  constexpr double view_error = sensing::ReadingModel::view_error;
  const Eigen::Matrix<double, 3, 2> axes = geometry::plane_axes(patch.plane.normal).leftCols<2>();
  std::vector<Eigen::Vector2d> crossing, spread;
  crossing.reserve(indices.size());
  spread.reserve(indices.size());
  for (const Index i : indices) {
    const Reading& r = readings[i];
    const double per_height = 1 / std::max(r.cos_incidence(patch.plane), view_error);
    const Eigen::Vector2d sight = per_height * (axes.transpose() * r.view.cast<double>());
    crossing.emplace_back(axes.transpose() * r.position.cast<double>() - r.distance(patch.plane) * sight);
    spread.emplace_back(readings.model().reach(r.range_class, 1) * view_error * sight);
  }
  constexpr double unknown = std::numeric_limits<double>::infinity();
  const double spacing = readings.resolution();
  const auto median_width = [&](double width, double along) {
    return geometry::median_local_width(crossing, width, spacing, width_places, spread, along);
  };
  if (const auto width = median_width(limits.least_width, unknown)) return *width;
  if (limits.gap <= spacing) return unknown;
  for (int gaps = 1; gaps <= gaps_between_lines; gaps *= 2)
    if (median_width(gaps * limits.gap, spacing)) return unknown;
  return 0;
}

using Refusal = surfaces::Refusal;

/// Without readings beside another plane's: at an edge a voxel's mean mixes both faces.
std::vector<Index> clear_of_other_planes(const Readings& readings, const std::vector<Label>& labels,
                                         const std::vector<Index>& indices) {
  std::vector<Index> clear;
  std::copy_if(indices.begin(), indices.end(), std::back_inserter(clear), [&](Index i) {
    const auto& near = readings.near(i);
    return std::all_of(near.begin(), near.end(),
                       [&](Index j) { return labels[j] == clutter || labels[j] == labels[i]; });
  });
  return clear;
}

/// The side from which a patch was seen is unknown, such as for level rays along a ceiling at their height,
/// if the mean cosine of its readings is below two standard errors. Errors of stored views are uniform up
/// to view_error, so their deviation is view_error/√3; views of one direction share theirs.
std::optional<Refusal> refusal_of_side(const Readings& readings, const Patch& patch,
                                       const std::vector<Index>& indices) {
  constexpr double view_error = sensing::ReadingModel::view_error;
  double sum = 0;
  for (const Index i : indices) sum += readings[i].cos_incidence(patch.plane);
  const double cos_incidence = sum / static_cast<double>(indices.size());
  if (cos_incidence > 2 * view_error / std::sqrt(3)) return {};
  std::set<std::array<float, 3>> views;
  for (const Index i : indices) {
    const Eigen::Vector3f& view = readings[i].view;
    views.insert({view.x(), view.y(), view.z()});
  }
  const double least = 2 * view_error / std::sqrt(3 * static_cast<double>(views.size()));
  if (cos_incidence > least) return {};
  return Refusal{.reason = Reason::edge_on, .measured = cos_incidence, .limit = least};
}

/// None for a patch that is large enough, wide enough, not seen edge-on and not curved. The part outside is
/// known only as sums, which contribute their extent.
std::optional<Refusal> refusal_by_shape(const Readings& readings, const SegmentLimits& limits,
                                        const std::vector<Label>& labels, const Patch& patch,
                                        const std::vector<Index>& indices, const Patch& outside) {
  const double size = static_cast<double>(indices.size()) + outside.readings;
  if (size < static_cast<double>(limits.fewest_points))
    return Refusal{.reason = Reason::too_few_points,
                   .measured = size,
                   .limit = static_cast<double>(limits.fewest_points)};
  geometry::Moments extent;  // unweighted
  for (const Index i : indices) extent.add(readings[i].position.cast<double>() - patch.origin);
  if (outside.readings > 0)
    extent.add(outside.moments.shifted(patch.origin - outside.origin),
               outside.readings / outside.moments.count);
  double width = geometry::width_of(extent);
  if (width >= limits.least_width && !(outside.readings > 0))
    width = std::min(width, width_in_most_places(readings, limits, patch, indices));
  if (width < limits.least_width)
    return Refusal{.reason = Reason::too_narrow, .measured = width, .limit = limits.least_width};
  if (!(outside.readings > 0))
    if (const auto unsided = refusal_of_side(readings, patch, indices)) return unsided;
  if (!(outside.readings > 0) &&
      (is_curved(readings, patch, indices) ||
       is_curved_in_places(readings, patch, clear_of_other_planes(readings, labels, indices))))
    return Refusal{Reason::curved};
  return {};
}

/// m, on both sides of a patch together: the depth in which clutter around it is counted, beyond the range of
/// its own readings.
double depth_around(const Patch& patch) { return sensing::ReadingModel::clutter_depth + 2 * patch.reach(); }

/// For each label, the hits of clutter beside its readings, within depth_around(). Hits rather than voxels,
/// because with time the tails of a surface's noise reach more and more voxels once each, while its own are
/// hit repeatedly.
std::vector<double> count_clutter_around(const Readings& readings, const Segmentation& segmentation) {
  std::vector<double> half_depth;
  for (const Patch& patch : segmentation.patches) half_depth.push_back(depth_around(patch) / 2);
  half_depth[clutter] = 0;
  const double farthest = *std::max_element(half_depth.begin(), half_depth.end());
  const int reach = std::max(1, static_cast<int>(farthest / readings.resolution()));
  const LabelBlocks blocks(readings, segmentation.labels, std::vector<bool>(readings.size(), true));
  std::vector<double> counts(segmentation.patches.size(), 0);
  std::vector<Index> tested_from(counts.size(), Readings::none), settled_from = tested_from;
  const auto count = [&](Index i, const LabelBlocks::Group& group, const occupancy::BlockPart& part) {
    const Label label = group.label;
    if (settled_from[label] == i) return;
    const bool out_of_depth =
        tested_from[label] != i &&
        std::fabs(readings[i].distance(segmentation.patches[label].plane)) > half_depth[label];
    tested_from[label] = i;
    const bool beside = !out_of_depth && LabelBlocks::any_of(group, part);
    if (beside) counts[label] += readings[i].hits;
    if (beside || out_of_depth) settled_from[label] = i;
  };
  const auto count_around = [&](Index i, const std::vector<const LabelBlocks::Block*>& near) {
    for (const LabelBlocks::Block* block : near) {
      const occupancy::BlockPart part = block->within(readings[i].key, reach);
      if (part.slice == 0) continue;
      for (const LabelBlocks::Group& group : block->groups)
        if (group.label != clutter) count(i, group, part);
    }
  };
  blocks.for_each_group(
      reach, [](const auto& group) { return group.label == clutter; },
      [&](const LabelBlocks::Group& group, const std::vector<const LabelBlocks::Block*>& near) {
        for (const Index i : group.members) count_around(i, near);
      });
  return counts;
}

/// Nats by which a plane with surrounding clutter explains the readings there better than clutter alone, less
/// its description. The plane's share of those readings is estimated (Laplace's rule of succession): nine
/// tenths for a wall, hardly any for a slab through a bush.
double explained_by(const Readings& readings, const Patch& patch, const std::vector<Index>& indices,
                    double clutter_around) {
  double its = 0, all = 0, explained = 0;
  for (const Index i : indices) {
    all += readings[i].hits;
    const double log_ratio = readings.log_ratio(i, patch.plane);
    if (!(log_ratio > 0)) continue;  // beyond the refitted plane: clutter, too
    its += readings[i].hits;
    explained += readings[i].hits * log_ratio;
  }
  const double others = all + clutter_around - its;
  const double share = (its + 1) / (its + others + 2);
  const double deeper = std::log(depth_around(patch) / sensing::ReadingModel::clutter_depth);
  return explained + its * (std::log(share) + deeper - sensing::ReadingModel::log_odds) +
         others * std::log(1 - share) - description_cost(patch);
}

/// Nats by which a plane explains more than the evidence against it, and the plane that contributes most of
/// the rays against it.
struct Verdict {
  double evidence = 0;
  Label seen_through = clutter;
  bool accepted() const { return evidence > 0; }
};

/// Decides which planes exist, in descending order of explained nats: a plane is rejected unless it explains
/// more than the rays that passed through it, or through planes accepted before to reach it, speak against
/// both. Such rays are as rare as outliers.
std::vector<Verdict> resolve_see_through(Crossings* crossings, const Segmentation& segmentation,
                                         const std::vector<double>& explained) {
  std::vector<std::vector<std::pair<Label, double>>> crossed(explained.size());
  if (crossings != nullptr)
    for (const auto& [pair, rays] : crossings->count(segmentation.labels, segmentation.patches)) {
      crossed[pair.first].emplace_back(pair.second, rays);
      crossed[pair.second].emplace_back(pair.first, rays);
    }
  std::vector<Label> order(explained.size());
  std::iota(order.begin(), order.end(), Label{0});
  std::stable_sort(order.begin(), order.end(), [&](Label a, Label b) { return explained[a] > explained[b]; });
  std::vector<Verdict> verdicts(explained.size());
  for (const Label label : order) {
    Verdict& verdict = verdicts[label];
    verdict.evidence = explained[label];
    double most_rays = 0;
    for (const auto& [other, rays] : crossed[label]) {
      if (!verdicts[other].accepted()) continue;
      verdict.evidence -= rays * sensing::ReadingModel::log_odds;
      if (rays > most_rays && explained[label] > 0) verdict.seen_through = other;
      most_rays = std::max(most_rays, rays);
    }
  }
  return verdicts;
}

/// The current surface of most of a label's readings; 0: none.
SurfaceId surface_of(const Readings& readings, const Segmentation& segmentation, Label label) {
  std::map<SurfaceId, std::size_t> counts;
  for (Index i = 0; i < readings.size_with_context(); ++i)
    if (segmentation.labels[i] == label) ++counts[readings[i].surface];
  const auto most = std::max_element(counts.begin(), counts.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == counts.end() ? 0 : most->first;
}

Refusal refusal_of(const Readings& readings, const Segmentation& segmentation, const Verdict& verdict) {
  if (verdict.seen_through != clutter)
    if (const SurfaceId surface = surface_of(readings, segmentation, verdict.seen_through); surface != 0)
      return {.reason = Reason::seen_through, .surface = surface};
  return {.reason = Reason::clutter, .measured = verdict.evidence};
}

/// Turns rejected patches into clutter: refusal_of(label, readings) is the reason, or none.
template <class RefusalOf>
void keep_labels(const Readings& readings, Segmentation& segmentation, std::vector<Refused>* refused,
                 RefusalOf&& refusal_of) {
  const std::vector<std::vector<Index>> of = segmentation.by_label(readings.size());
  std::vector<Label> into(segmentation.patches.size(), clutter);
  std::vector<Patch> kept(1);
  for (Label label = 1; label < segmentation.patches.size(); ++label) {
    if (const std::optional<Refusal> why = refusal_of(label, of[label])) {
      if (refused != nullptr) refused->push_back({*why, of[label]});
      continue;
    }
    into[label] = static_cast<Label>(kept.size());
    kept.push_back(segmentation.patches[label]);
  }
  segmentation.follow(into, std::move(kept));
}

/// `judged`: the size of each patch when its shape was accepted, if it was.
void accept(const Readings& readings, const SegmentLimits& limits, Crossings& crossings,
            Segmentation& segmentation, std::vector<Refused>* refused,
            const std::vector<std::size_t>& judged = {}) {
  const auto is_as_judged = [&](Label label, std::size_t size, double outside) {
    if (judged.empty() || static_cast<double>(size) + outside < static_cast<double>(limits.fewest_points))
      return false;
    const std::size_t before = judged[label];
    return judged_share * (std::max(before, size) - std::min(before, size)) <= before;
  };
  keep_labels(readings, segmentation, refused,
              [&, outside = sums_outside(segmentation)](
                  Label label, const std::vector<Index>& indices) -> std::optional<Refusal> {
                if (is_as_judged(label, indices.size(), outside[label].readings)) return {};
                const auto why = refusal_by_shape(readings, limits, segmentation.labels,
                                                  segmentation.patches[label], indices, outside[label]);
                if (why && why->reason == Reason::too_few_points)
                  segmentation.too_few.insert(segmentation.too_few.end(), indices.begin(), indices.end());
                if (why && (why->reason == Reason::curved || why->reason == Reason::too_narrow))
                  segmentation.curved.push_back(indices);
                return why;
              });
  const std::vector<double> around = count_clutter_around(readings, segmentation);
  const std::vector<std::vector<Index>> of = segmentation.by_label(readings.size());
  std::vector<double> explained(of.size(), 0);
  for (Label label = 1; label < of.size(); ++label)
    explained[label] = explained_by(readings, segmentation.patches[label], of[label], around[label]);
  for (const Outside& outside : segmentation.outside)
    if (outside.label != clutter)
      explained[outside.label] += outside.sums.hits / outside.sums.readings *
                                  outside.sums.explained_by(segmentation.patches[outside.label].plane);
  const std::vector<Verdict> verdicts =
      resolve_see_through(limits.see_through ? &crossings : nullptr, segmentation, explained);
  keep_labels(readings, segmentation, refused, [&](Label label, const auto&) -> std::optional<Refusal> {
    if (verdicts[label].accepted()) return {};
    if (refused == nullptr) return Refusal{Reason::clutter};  // reason not requested: O(readings)
    return refusal_of(readings, segmentation, verdicts[label]);
  });
}

}  // namespace

Segmentation segment(const Readings& readings, const SegmentLimits& limits) {
  Segmentation nothing;
  nothing.labels.assign(readings.size_with_context(), clutter);
  return segment(readings, limits, with_seed_patches(readings, std::move(nothing)));
}

Segmentation segment(const Readings& readings, const SegmentLimits& limits, Segmentation known,
                     std::vector<Refused>* refused) {
  Segmentation result = std::move(known);
  Junctions junctions(readings, result.labels, result.patches);
  for (int round = 0; round < rounds; ++round) {
    const std::vector<Label> before = result.labels;
    // Seed patches are no larger than a gap, so nearly every reading would be at a boundary.
    merge(readings, round == 0 ? 0 : limits.gap, junctions, result);
    relabel(readings, result.patches, result.labels);
    junctions = Junctions(readings, result.labels, result.patches);
    part_into_pieces(readings, junctions, result);
    junctions.renew(result.labels, result.patches);
    // Pieces are numbered in the order of their first readings, so that the same ones have the same labels.
    const std::size_t changed = std::transform_reduce(before.begin(), before.end(), result.labels.begin(),
                                                      std::size_t{0}, std::plus(), std::not_equal_to());
    if (round > 0 && settled_share * changed <= readings.size()) break;
  }
  merge(readings, limits.gap, junctions, result);
  Crossings crossings(readings);
  accept(readings, limits, crossings, result, refused);
  std::vector<std::size_t> judged;
  for (const std::vector<Index>& its : result.by_label(readings.size())) judged.push_back(its.size());
  relabel(readings, result.patches, result.labels);
  refit_patches(readings, Junctions(readings, result.labels, result.patches), result);
  accept(readings, limits, crossings, result, refused, judged);
  return result;
}

}  // namespace octosurf::detection
