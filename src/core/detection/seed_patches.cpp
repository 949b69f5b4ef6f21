#include "detection/seed_patches.hpp"

#include "detection/constants.hpp"
#include "detection/voxel_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

constexpr std::size_t scored = 200;  // maximum number of readings that score a hypothesis

/// RANSAC among the readings of one block, plane after plane. Hypotheses are scored by likelihood instead of
/// by a count of inliers within s (as MLESAC, Torr and Zisserman 2000), and the best is refitted.
class Ransac {
 public:
  Ransac(const Readings& readings, std::vector<Index> indices, std::uint64_t seed)
      : readings_(readings), left_(std::move(indices)), random_(seed) {}

  struct FittedPlane {
    Patch patch;
    std::vector<Index> indices;
  };
  /// Extracts the best plane of the remaining readings, if it explains more than it costs.
  std::optional<FittedPlane> next() {
    if (left_.size() < Constants::fewest_of_plane) return {};
    Plane plane = best_plane();
    for (int round = 0; round < 2; ++round) {
      const std::vector<Index> its = belonging(plane);
      if (its.size() < Constants::fewest_of_plane) return {};
      plane = readings_.patch_of(its, plane).plane;
    }
    FittedPlane found;
    found.indices = belonging(plane);
    if (found.indices.size() < Constants::fewest_of_plane) return {};
    found.patch = readings_.patch_of(found.indices, plane);
    double explained = 0;
    for (const Index i : found.indices) explained += readings_.log_ratio(i, plane);
    if (!(explained > description_cost(found.patch))) return {};
    std::erase_if(left_,
                  [&](Index i) { return std::binary_search(found.indices.begin(), found.indices.end(), i); });
    return found;
  }

 private:
  Eigen::Vector3d position(Index i) const { return readings_[i].position.cast<double>(); }

  std::vector<Index> belonging(const Plane& plane) const {
    std::vector<Index> its;
    for (const Index i : left_)
      if (readings_.gain(i, plane) > 0) its.push_back(i);
    return its;
  }

  struct Score {
    double gain = 0;  // nats
    double share = 0;
  };
  Score score(const Plane& plane) const {
    const std::size_t step = 1 + left_.size() / scored;
    Score score;
    std::size_t belonging = 0, all = 0;
    for (std::size_t k = 0; k < left_.size(); k += step, ++all) {
      const double gain = readings_.gain(left_[k], plane);
      score.gain += gain;
      belonging += gain > 0;
    }
    score.share = static_cast<double>(belonging) / static_cast<double>(all);
    return score;
  }
  static double trials_for(double share) {
    const double missed = 1 - share * share * share;  // by one trial
    return missed > 0 ? std::log(1 - seed_patch_certainty) / std::log(missed) : 0;
  }

  /// Orients the normal toward the majority of the readings' sensors.
  Plane facing_sensor(Plane plane, std::span<const Index> seen) const {
    double cos_incidence = 0;
    for (const Index i : seen) cos_incidence += readings_[i].cos_incidence(plane);
    if (cos_incidence < 0) plane = {-plane.normal, -plane.offset};
    return plane;
  }

  Plane least_squares() const {
    Plane plane{readings_[left_.front()].view.cast<double>(), 0};
    plane = readings_.patch_of(left_, plane).plane;
    return facing_sensor(plane, left_);
  }

  std::optional<Plane> through_three() {
    std::array<Index, 3> drawn;
    for (Index& i : drawn) i = left_[random_() % left_.size()];
    const Eigen::Vector3d a = position(drawn[0]);
    const Eigen::Vector3d normal = (position(drawn[1]) - a).cross(position(drawn[2]) - a);
    const double area = normal.norm(), d = readings_.resolution();
    if (area < d * d) return {};  // collinear or coincident
    return facing_sensor({normal / area, normal.dot(a) / area}, drawn);
  }

  Plane best_plane() {
    Plane best = least_squares();
    Score most = score(best);
    for (int k = 0; k < seed_patch_trials && k < trials_for(most.share); ++k) {
      const std::optional<Plane> plane = through_three();
      if (!plane) continue;
      const Score of_plane = score(*plane);
      if (of_plane.gain <= most.gain) continue;
      most = of_plane;
      best = *plane;
    }
    return best;
  }

  const Readings& readings_;
  std::vector<Index> left_;  // ascending
  std::mt19937_64 random_;   // seeded by the block, so that the order of blocks does not matter
};

/// Readings without a label that may seed a plane, by block.
std::map<VoxelBlocks::Place, std::vector<Index>> by_block(const Readings& readings,
                                                          const std::vector<Label>& labels,
                                                          const VoxelBlocks& blocks) {
  std::map<VoxelBlocks::Place, std::vector<Index>> all;
  for (Index i = 0; i < readings.size(); ++i)
    if (labels[i] == clutter && readings[i].may_seed) all[blocks.of(readings[i].key)].push_back(i);
  return all;
}

}  // namespace

int seed_patch_edge(double resolution) {
  return std::max(4, static_cast<int>(std::lround(Constants::smallest_edge / resolution)));
}

Segmentation with_seed_patches(const Readings& readings, Segmentation segmentation) {
  std::vector<Patch>& patches = segmentation.patches;
  for (int level = 0; level < seed_patch_levels; ++level) {
    const VoxelBlocks blocks(seed_patch_edge(readings.resolution()) << level);
    for (auto& [place, indices] : by_block(readings, segmentation.labels, blocks)) {
      Ransac ransac(readings, std::move(indices), place);
      while (const std::optional<Ransac::FittedPlane> found = ransac.next()) {
        for (const Index i : found->indices) segmentation.labels[i] = static_cast<Label>(patches.size());
        patches.push_back(found->patch);
      }
    }
  }
  return segmentation;
}

}  // namespace octosurf::detection
