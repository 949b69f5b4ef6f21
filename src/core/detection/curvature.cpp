#include "detection/curvature.hpp"

#include "detection/constants.hpp"
#include "detection/seed_patches.hpp"
#include "detection/voxel_blocks.hpp"
#include "geometry/plane_frame.hpp"
#include "geometry/symmetric.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <ranges>
#include <utility>
#include <vector>

namespace octosurf::detection {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

using Points = std::vector<occupancy::VoxelPoint>;

/// All voxels of the readings that the patch explains: a cell's one point says little about a bar as narrow
/// as three cells. The others of a cell may be of a face beside it.
Points voxels_of(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices) {
  Points points;
  points.reserve(indices.size());
  for (const Readings::Index i : indices) {
    bool first = true;
    readings.for_each_voxel(i, [&](PointId, const occupancy::VoxelPoint& p) {
      if (std::exchange(first, false) || readings.model().belongs(p, patch.plane)) points.push_back(p);
    });
  }
  return points;
}

/// Σ w of {1, u, v, u²/2, uv, v²/2} and of heights over the patch's plane: weights of the noise alone,
/// because common errors cause no curvature.
struct QuadraticSums {
  Matrix6 normal = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
};

/// `points`: readings or voxels.
template <class Range>
QuadraticSums sums_of(const Readings& readings, const Patch& patch, const Range& points,
                      const Eigen::Matrix3d& R, const Eigen::Vector3d& origin) {
  QuadraticSums sums;
  for (const auto& r : points) {
    const Eigen::Vector3d p = R * (r.position.template cast<double>() - origin);
    Vector6 basis;
    basis << 1, p.x(), p.y(), 0.5 * p.x() * p.x(), p.x() * p.y(), 0.5 * p.y() * p.y();
    const double w = 1 / readings.model().independent_variance(
                             r.range_class, patch.plane.normal.dot(r.view.template cast<double>()));
    sums.normal += w * basis * basis.transpose();
    sums.right += w * p.z() * basis;
  }
  return sums;
}

/// Variance (1/m²) of curvature that does not average out, because the middle readings may share an offset
/// against both ends: with a sagitta of L²κ/8, 64·(1 + ½)·σ² / L⁴. `length2`: L², m².
double common_variance_of_bend(double pose_variance, double length2) {
  return 96 * pose_variance / std::max(length2 * length2, 1e-12);
}

/// Rotation from the map to u across a patch, v along it, and its normal.
struct PrincipalFrame {
  Eigen::Matrix3d R;
  Eigen::Vector2d variances;  ///< of its readings across and along, m²
  double pose_variance;       ///< of the readings' common error, m²

  explicit PrincipalFrame(const Patch& patch)
      : R(geometry::plane_axes(patch.plane.normal).transpose()), pose_variance(patch.pose_variance) {
    const Eigen::Matrix3d in_plane = R * patch.moments.covariance() * R.transpose();
    const geometry::PrincipalAxes2 axes = geometry::principal_axes(in_plane.topLeftCorner<2, 2>().eval());
    R.topRows<2>() = (axes.vectors.transpose() * R.topRows<2>()).eval();
    variances = axes.values.cwiseMax(0.0);
  }

  /// Squared lengths for curvature, m²: across, both, along; a uniform strip is √12 deviations long.
  Eigen::Vector3d lengths2() const {
    return 12 * Eigen::Vector3d(variances[0], std::sqrt(variances.prod()), variances[1]);
  }
  /// For curvature across, twist and along; for the twist two corners may be off against the other two, 4·σ²
  /// / L⁴.
  Eigen::Vector3d common_variance() const {
    const Eigen::Vector3d L2 = lengths2();
    return {common_variance_of_bend(pose_variance, L2[0]), common_variance_of_bend(pose_variance, L2[1]) / 24,
            common_variance_of_bend(pose_variance, L2[2])};
  }
};

/// Turn of the normal of u²κ_u/2 + uvκ_uv + v²κ_v/2 over readings with these variances along its axes (m²).
double turn_of(const Eigen::Vector3d& bend, const Eigen::Vector2d& variances) {
  Eigen::Matrix2d hessian;
  hessian << bend[0], bend[1], bend[1], bend[2];
  const geometry::PrincipalAxes2 axes = geometry::principal_axes(hessian);
  double most = 0;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d along = axes.vectors.col(k);
    most =
        std::max(most, std::fabs(axes.values[k]) * std::sqrt(12 * along.dot(variances.cwiseProduct(along))));
  }
  return most;
}

/// Log Bayes factor of one curvature against none: of evidence (Σ w·height, projected), with the posterior
/// and prior information.
double log_bayes_of(double evidence, double posterior, double prior) {
  return 0.5 * (evidence * evidence / posterior - std::log(posterior / prior));
}

/// Curvature across each of some blocks, with offset and slopes eliminated.
struct BendAcross {
  double information = 0, evidence = 0;
  double width2 = 0;  ///< Σ information times a block's squared width, m²

  void add(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices) {
    constexpr std::size_t fewest = 6;  // four parameters, and two readings to contradict them
    const Points block = voxels_of(readings, patch, indices);
    if (block.size() < fewest) return;
    Patch part = patch;
    part.moments = {};
    for (const occupancy::VoxelPoint& p : block) part.moments.add(p.position.cast<double>() - part.origin);
    const PrincipalFrame frame(part);
    const QuadraticSums sums = sums_of(readings, patch, block, frame.R, part.centroid());
    const Eigen::Vector3d mixed = sums.normal.block<3, 1>(0, 3);
    const Eigen::Vector3d eliminated = Eigen::Matrix3d(sums.normal.topLeftCorner<3, 3>()).ldlt().solve(mixed);
    const double of_block = sums.normal(3, 3) - mixed.dot(eliminated);
    if (!(of_block > 0)) return;
    information += of_block;
    evidence += sums.right[3] - sums.right.head<3>().dot(eliminated);
    width2 += of_block * frame.lengths2()[0];
  }
};

}  // namespace

bool is_curved_in_places(const Readings& readings, const Patch& patch,
                         std::span<const Readings::Index> indices) {
  const VoxelBlocks blocks(seed_patch_edge(readings.resolution()));
  std::vector<std::pair<VoxelBlocks::Place, Readings::Index>> by_block;
  by_block.reserve(indices.size());
  for (const Readings::Index i : indices) by_block.emplace_back(blocks.of(readings[i].key), i);
  std::sort(by_block.begin(), by_block.end());
  BendAcross bend;
  std::vector<Readings::Index> block;
  for (std::size_t k = 0; k < by_block.size(); ++k) {
    block.push_back(by_block[k].second);
    if (k + 1 < by_block.size() && by_block[k + 1].first == by_block[k].first) continue;
    bend.add(readings, patch, block);
    block.clear();
  }
  if (!(bend.information > 0)) return false;
  const double width2 = bend.width2 / bend.information;  // the prior variance
  const double kept = 1 / (1 + bend.information * common_variance_of_bend(patch.pose_variance, width2));
  const double posterior = kept * bend.information + width2, evidence = kept * bend.evidence;
  // Away from the sensor; such strips are as rare as clutter readings.
  return log_bayes_of(evidence, posterior, width2) > sensing::ReadingModel::log_odds &&
         -evidence / posterior * std::sqrt(width2) > Constants::least_turn;
}

bool is_curved(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices) {
  const PrincipalFrame frame(patch);
  const Eigen::Matrix3d& R = frame.R;
  const QuadraticSums sums = sums_of(
      readings, patch,
      indices | std::views::transform([&](Readings::Index i) -> const Reading& { return readings[i]; }), R,
      patch.centroid());
  // Curvatures with offset and slopes eliminated (Schur complement).
  const Eigen::Matrix3d plane = sums.normal.topLeftCorner<3, 3>(), mixed = sums.normal.topRightCorner<3, 3>();
  const Eigen::LDLT<Eigen::Matrix3d> solver(plane);
  const Eigen::Matrix3d by_noise =
      sums.normal.bottomRightCorner<3, 3>() - mixed.transpose() * solver.solve(mixed);
  const Eigen::Vector3d right =
      sums.right.tail<3>() - mixed.transpose() * solver.solve(Eigen::Vector3d(sums.right.head<3>()));
  const Eigen::Matrix3d kept =
      (Eigen::Matrix3d::Identity() + by_noise * Eigen::Matrix3d(frame.common_variance().asDiagonal()))
          .inverse();
  const Eigen::Matrix3d information = kept * by_noise;
  const Eigen::Vector3d evidence = kept * right;
  // Prior: the curvature turns the patch by about 1 rad from end to end, along and across.
  const Eigen::Vector3d prior = frame.lengths2();
  const Eigen::Matrix3d posterior = information + Eigen::Matrix3d(prior.asDiagonal());
  const Eigen::Vector3d bend = posterior.ldlt().solve(evidence);
  const auto one_way = [&](int k) { return log_bayes_of(evidence[k], posterior(k, k), prior[k]); };
  const double any_way = 0.5 * (bend.dot(evidence) - std::log(posterior.determinant() / prior.prod()));
  constexpr double log_three = 1.0986122886681098;  // three hypotheses: across, along, any
  const double log_bayes = std::max({one_way(0), one_way(2), any_way}) - log_three;
  return log_bayes > 0 && turn_of(bend, frame.variances) > Constants::least_turn;
}

}  // namespace octosurf::detection
