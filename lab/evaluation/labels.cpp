#include "evaluation/labels.hpp"

#include "geometry/symmetric.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::evaluation {
namespace {

/// Least-squares plane of a label's points.
struct Fit {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double rms = 0;
};

// Two passes: moments about the origin lose digits far from it.
Fit fit_plane(const std::vector<Eigen::Vector3d>& points) {
  Fit fit;
  for (const Eigen::Vector3d& point : points) fit.centroid += point;
  fit.centroid /= static_cast<double>(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d d = point - fit.centroid;
    covariance += d * d.transpose();
  }
  covariance /= static_cast<double>(points.size());
  const geometry::PrincipalAxes3 axes = geometry::principal_axes(covariance);
  fit.normal = axes.vectors.col(0);
  fit.rms = std::sqrt(std::max(0.0, axes.values[0]));
  return fit;
}

/// Labels, surfaces, and how many points they share; all by ascending label or id.
struct SharedPoints {
  std::vector<std::uint32_t> labels;
  std::vector<SurfaceId> surfaces;
  std::vector<Fit> fits;                                               // per label
  std::vector<std::size_t> label_points, surface_points, categorized;  // categorized: per label
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> common;   // by (label, surface) index
};

template <class T>
std::size_t index_of(const std::vector<T>& sorted, T value) {
  return static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin());
}

template <class T>
void sort_unique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

SharedPoints count(const LabelledCloud& cloud, std::span<const Eigen::Vector3d> points,
                   std::span<const SurfaceId> found) {
  SharedPoints counts;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (cloud.labels[i] == 0) continue;
    counts.labels.push_back(cloud.labels[i]);
    if (found[i] != 0) counts.surfaces.push_back(found[i]);
  }
  sort_unique(counts.labels);
  sort_unique(counts.surfaces);
  counts.categorized.assign(counts.labels.size(), 0);
  counts.surface_points.assign(counts.surfaces.size(), 0);
  std::vector<std::vector<Eigen::Vector3d>> by_label(counts.labels.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (cloud.labels[i] == 0) continue;
    const std::size_t label = index_of(counts.labels, cloud.labels[i]);
    by_label[label].push_back(points[i]);
    if (found[i] == 0) continue;
    const std::size_t surface = index_of(counts.surfaces, found[i]);
    ++counts.categorized[label];
    ++counts.surface_points[surface];
    ++counts.common[{label, surface}];
  }
  for (const auto& label_points : by_label) {
    counts.fits.push_back(fit_plane(label_points));
    counts.label_points.push_back(label_points.size());
  }
  return counts;
}

HooverResult judge(const SharedPoints& counts, LabelledCloud::Kind kind, const LabelOptions& options) {
  HooverRegions regions;
  const bool planes = kind == LabelledCloud::Kind::planes;
  for (std::size_t i = 0; i < counts.labels.size(); ++i) {
    regions.truth_judged.push_back(counts.label_points[i] >= options.min_points &&
                                   counts.fits[i].rms <= options.max_rms &&
                                   (planes || counts.labels[i] == 1));
  }
  if (std::find(regions.truth_judged.begin(), regions.truth_judged.end(), true) ==
      regions.truth_judged.end()) {
    throw Error(Error::Kind::data, "labels", "no label is a plane with enough points",
                "give a labelled cloud in metres");
  }
  for (const std::size_t points : counts.surface_points) {
    regions.found_judged.push_back(planes && points >= options.min_points);
  }
  regions.covered_by_parts.assign(counts.labels.size(), 0);
  std::vector<Overlap> overlaps;
  for (const auto& [key, points] : counts.common) {
    const auto [label, surface] = key;
    overlaps.push_back({label, surface, share(points, counts.label_points[label]),
                        share(points, counts.surface_points[surface])});
    // A point is in one surface only, so shares add up to the union's.
    if (overlaps.back().found_share >= options.threshold) {
      regions.covered_by_parts[label] += overlaps.back().truth_share;
    }
  }
  return hoover(regions, overlaps, options.threshold);
}

LabelScore score_label(const SharedPoints& counts, const HooverResult& verdicts, std::size_t label,
                       const Snapshot& snapshot) {
  LabelScore score;
  score.label = counts.labels[label];
  score.verdict = verdicts.truth[label];
  score.points = counts.label_points[label];
  score.rms_m = counts.fits[label].rms;
  score.covered = share(counts.categorized[label], score.points);
  std::size_t best = 0, surface = 0;
  for (auto it = counts.common.lower_bound({label, 0}); it != counts.common.end() && it->first.first == label;
       ++it) {
    if (it->second <= best) continue;
    best = it->second;
    surface = it->first.second;
  }
  if (best == 0) return score;
  score.surface = counts.surfaces[surface];
  score.by_surface = share(best, score.points);
  score.of_surface = share(best, counts.surface_points[surface]);
  score.iou = share(best, score.points + counts.surface_points[surface] - best);
  const Plane& plane = snapshot.find(score.surface)->plane;
  const Eigen::Vector3d& normal = counts.fits[label].normal;
  score.normal_rad = std::atan2(normal.cross(plane.normal).norm(), std::abs(normal.dot(plane.normal)));
  score.offset_m = plane.signed_distance(counts.fits[label].centroid);
  return score;
}

void require_input(const LabelledCloud& cloud, std::span<const Eigen::Vector3d> points,
                   std::span<const SurfaceId> found, const Snapshot& snapshot) {
  if (cloud.labels.size() != points.size() || found.size() != points.size()) {
    throw Error(Error::Kind::usage, "labels", "numbers of points, labels and surfaces differ");
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) throw Error(Error::Kind::data, cloud.name, "a point is not finite");
    if (found[i] != 0 && !snapshot.find(found[i])) {
      throw Error(Error::Kind::data, "surface " + std::to_string(found[i]), "is not in the snapshot");
    }
  }
}

}  // namespace

LabelEvaluation evaluate_labels(const LabelledCloud& cloud, std::span<const Eigen::Vector3d> points,
                                std::span<const SurfaceId> found, const Snapshot& snapshot,
                                const LabelOptions& options) {
  require_input(cloud, points, found, snapshot);
  const SharedPoints counts = count(cloud, points, found);
  const HooverResult verdicts = judge(counts, cloud.kind, options);

  LabelEvaluation result;
  std::vector<double> normals, offsets;
  std::size_t judged_points = 0, categorized = 0;
  for (std::size_t i = 0; i < counts.labels.size(); ++i) {
    const LabelScore& score = result.label_scores.emplace_back(score_label(counts, verdicts, i, snapshot));
    result.points += score.points;
    result.correct += score.verdict == TruthVerdict::correct;
    result.over_segmented += score.verdict == TruthVerdict::over_segmented;
    result.under_segmented += score.verdict == TruthVerdict::under_segmented;
    result.missed += score.verdict == TruthVerdict::missed;
    if (score.verdict == TruthVerdict::not_judged) continue;
    ++result.labels;
    judged_points += score.points;
    categorized += counts.categorized[i];
    result.mean_iou += score.iou;
    if (cloud.kind == LabelledCloud::Kind::support) result.support_iou = score.iou;
    if (score.verdict != TruthVerdict::correct) continue;
    normals.push_back(score.normal_rad);
    offsets.push_back(std::abs(score.offset_m));
  }
  result.mean_iou /= static_cast<double>(result.labels);
  result.coverage = share(categorized, judged_points);
  result.normal_rad = summarize(std::move(normals));
  result.offset_m = summarize(std::move(offsets));
  result.surfaces = counts.surfaces.size();
  for (const FoundVerdict verdict : verdicts.found) result.noise += verdict == FoundVerdict::noise;
  return result;
}

}  // namespace octosurf::evaluation
