#include "bench/labelled_failures.hpp"

#include "bench/support.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

namespace octosurf::bench {
namespace {

constexpr double deg = 180 / std::numbers::pi;
constexpr std::size_t shown_holders = 3;

/// How a label's plane lies and how densely it was seen.
struct Patch {
  std::size_t voxels = 0;
  double length = 0, width = 0;  // m, along the points' principal axes
  double range = 0;              // m, median
  double incidence_rad = 0;      // between the normal and the line of sight
  double spacing = 0;            // m, median of neighbouring readings
};

Patch describe(const VoxelCloud& cloud, std::uint32_t label) {
  std::vector<Eigen::Vector3d> points;
  std::vector<double> ranges, gaps;
  std::set<std::size_t> voxels;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.cloud->labels[i] != label) continue;
    if (i > 0 && cloud.cloud->labels[i - 1] == label)
      gaps.push_back((cloud.points[i] - cloud.points[i - 1]).norm());
    points.push_back(cloud.points[i]);
    ranges.push_back(cloud.points[i].norm());
    voxels.insert(cloud.voxel_of[i]);
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  Eigen::AlignedBox3d extent;
  for (const Eigen::Vector3d& p : points)
    extent.extend(Eigen::Vector3d(solver.eigenvectors().transpose() * p));
  Patch patch;
  patch.voxels = voxels.size();
  patch.length = extent.sizes()[2];
  patch.width = extent.sizes()[1];
  patch.range = percentile(ranges, 0.5);
  patch.incidence_rad =
      std::acos(std::min(1.0, std::abs(solver.eigenvectors().col(0).dot(mean.normalized()))));
  patch.spacing = percentile(gaps, 0.5);
  return patch;
}

using Counts = std::map<SurfaceId, std::map<std::uint32_t, std::size_t>>;  // points by surface and label

Counts count(const VoxelCloud& cloud, const Segmentation& segmentation) {
  Counts counts;
  for (std::size_t i = 0; i < segmentation.found.size(); ++i)
    if (cloud.cloud->labels[i] != 0) ++counts[segmentation.found[i]][cloud.cloud->labels[i]];
  return counts;
}

/// E.g. "#3 61 % (mostly label 7), pending 30 %": who holds the label's points.
std::string holders(const Counts& counts, std::uint32_t label) {
  std::vector<std::pair<std::size_t, SurfaceId>> by_points;
  std::size_t all = 0;
  for (const auto& [id, labels] : counts)
    if (const auto it = labels.find(label); it != labels.end()) {
      by_points.emplace_back(it->second, id);
      all += it->second;
    }
  std::sort(by_points.rbegin(), by_points.rend());
  std::ostringstream text;
  for (std::size_t k = 0; k < std::min(shown_holders, by_points.size()); ++k) {
    const auto [points, id] = by_points[k];
    const auto percent = 100 * points / all;
    if (percent == 0) break;
    if (k > 0) text << ", ";
    if (id == 0) {
      text << "pending " << percent << " %";
      continue;
    }
    text << '#' << id << ' ' << percent << " %";
    const auto& labels = counts.at(id);
    const auto main = std::max_element(labels.begin(), labels.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    if (main->first != label) text << " (mostly label " << main->first << ')';
  }
  return text.str();
}

std::string correct_elsewhere(const std::vector<Segmentation>& segmentations, std::uint32_t label) {
  std::string names;
  for (std::size_t k = 1; k < segmentations.size(); ++k)
    for (const evaluation::LabelScore& score : segmentations[k].evaluation.label_scores)
      if (score.label == label && score.verdict == evaluation::TruthVerdict::correct)
        names += (names.empty() ? "" : ", ") + segmentations[k].method;
  return names.empty() ? "none" : names;
}

}  // namespace

std::string failure_table(const VoxelCloud& cloud, const std::vector<Segmentation>& segmentations) {
  const Segmentation& ours = segmentations.front();
  const Counts counts = count(cloud, ours);
  TextTable table({"label", "verdict", "points", "voxels", "length × width m", "range m", "incidence °",
                   "readings apart mm", "rms mm", "held", "of holder", "normal °", "held by", "correct for"});
  bool any = false;
  for (const evaluation::LabelScore& score : ours.evaluation.label_scores) {
    if (score.verdict == evaluation::TruthVerdict::correct ||
        score.verdict == evaluation::TruthVerdict::not_judged)
      continue;
    any = true;
    const Patch patch = describe(cloud, score.label);
    table.add({std::to_string(score.label), std::string(name_of(score.verdict)), std::to_string(score.points),
               std::to_string(patch.voxels), fixed(patch.length, 2) + " × " + fixed(patch.width, 3),
               fixed(patch.range, 2), fixed(patch.incidence_rad * deg, 0), fixed(patch.spacing * 1e3, 1),
               fixed(score.rms_m * 1e3, 1), fixed(score.by_surface, 2), fixed(score.of_surface, 2),
               fixed(score.normal_rad * deg, 1), holders(counts, score.label),
               correct_elsewhere(segmentations, score.label)});
  }
  return any ? table.text() : std::string();
}

}  // namespace octosurf::bench
