#include "alignment/revisit.hpp"

#include "geometry/median.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace octosurf::alignment {
namespace {

/// Voxels: wide enough for tens of samples 2 m away, narrower than a stair's tread.
constexpr int patch_voxels = 16;
/// Voxels along the normal: less than the smallest step that matters to a robot.
constexpr int level_voxels = 4;
/// Cosine of the largest turn of a surface that counts as the same: 10°.
constexpr double same_side = 0.985;
constexpr int rounds = 3;
/// Minimum number of patches: twice the number of a pose's parameters.
constexpr std::size_t fewest_patches = 12;

/// Identifies the patch of a plane that contains a point. Columns run along the axis nearest to the normal.
class PatchKey {
 public:
  explicit PatchKey(double resolution)
      : width_(patch_voxels * resolution), level_(level_voxels * resolution) {}
  SeenPatches::Key operator()(const Eigen::Vector3d& point, const Plane& plane) const {
    int axis = 0;
    plane.normal.cwiseAbs().maxCoeff(&axis);
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double column = std::floor(point[a] / width_), row = std::floor(point[b] / width_);
    const double height =
        (plane.offset - plane.normal[a] * (column + 0.5) * width_ - plane.normal[b] * (row + 0.5) * width_) /
        plane.normal[axis];
    std::uint64_t key = 2 * static_cast<std::uint64_t>(axis) + (plane.normal[axis] > 0 ? 1 : 0);
    for (const double part : {column, row, std::floor(height / level_)})
      key = key << 20 | (static_cast<std::uint64_t>(static_cast<std::int64_t>(part)) & 0xfffff);
    return key;
  }

 private:
  double width_, level_;
};

/// A formerly seen patch with the scan's readings of it.
struct PatchRow {
  double residual, weight, noise;  // m, 1/m², m² from readings alone
  Twist by_pose;                   // of the residual, rotations by the lever
  SensorErrors by_error;
};

struct Sums {
  TwistCovariance pose = TwistCovariance::Zero();
  Eigen::Matrix<double, 6, sensor_error_size> across = decltype(across)::Zero();
  SensorErrorCovariance error = SensorErrorCovariance::Zero();
  Twist pose_right = Twist::Zero();
  SensorErrors error_right = SensorErrors::Zero();
};

}  // namespace

std::vector<PatchObservation> observe(const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                                      std::span<const MatchedReading> readings, const SeenPatches& patches,
                                      SensorKind sensor, double resolution) {
  const PatchKey key_of(resolution);
  std::vector<std::pair<SeenPatches::Key, const MatchedReading*>> by_key;
  by_key.reserve(readings.size());
  for (const MatchedReading& laid : readings)
    by_key.emplace_back(key_of(T_map_sensor * laid.point, laid.surface->plane), &laid);
  std::stable_sort(by_key.begin(), by_key.end(),
                   [](const auto& one, const auto& other) { return one.first < other.first; });
  std::vector<PatchObservation> observations;
  const Eigen::Matrix3d R_sensor_map = T_map_sensor.linear().transpose();
  for (std::size_t i = 0; i < by_key.size();) {
    PatchObservation observation;
    observation.key = by_key[i].first;
    if (const SeenPatch* known = patches.find(observation.key)) {
      observation.patch = *known;
    } else {
      observation.patch.normal = by_key[i].second->surface->plane.normal.cast<float>();
      observation.patch.offset = by_key[i].second->surface->plane.offset;
    }
    const Eigen::Vector3d normal = observation.patch.normal.cast<double>();
    for (; i < by_key.size() && by_key[i].first == observation.key; ++i) {
      const MatchedReading& laid = *by_key[i].second;
      if (laid.surface->plane.normal.dot(normal) < same_side) continue;
      const Eigen::Vector3d arm = T_map_sensor.linear() * laid.point;
      Twist by_pose;
      by_pose << arm.cross(normal), normal;
      const double weight = 1 / laid.variance;
      observation.weight += weight;
      const double share = weight / observation.weight;
      const double distance = normal.dot(T_map_sensor.translation() + arm) - observation.patch.offset;
      observation.distance += share * (distance - observation.distance);
      observation.by_pose += share * (by_pose - observation.by_pose);
      if (scan.sensor == sensor)
        observation.by_error +=
            share * (distance_by_error(sensor, laid.point, R_sensor_map * normal) - observation.by_error);
    }
    if (observation.weight > 0) observations.push_back(observation);
  }
  return observations;
}

Revisit measure(std::span<const PatchObservation> observations, double travelled_m,
                const SensorErrors& errors, double patch_m, double resolution) {
  Revisit revisit;
  std::vector<PatchRow> rows;
  double squares = 0;
  for (const PatchObservation& now : observations) {
    const Observation before = now.patch.before(travelled_m, revisit_span_m);
    if (!(before.weight > 0)) continue;
    squares += now.by_pose.head<3>().squaredNorm();
    rows.push_back({now.distance - before.distance, 0, 1 / now.weight + 1 / double{before.weight},
                    now.by_pose, now.by_error - before.by_error.cast<double>()});
  }
  revisit.patches = rows.size();
  if (rows.size() < fewest_patches) return revisit;
  revisit.lever_m = std::max(resolution, std::sqrt(squares / static_cast<double>(rows.size())));
  for (PatchRow& row : rows) row.by_pose.head<3>() /= revisit.lever_m;

  Twist motion = Twist::Zero();
  const double least = map_error_voxels * resolution;
  double scatter = std::max(least, patch_m);
  Sums sums;
  for (int round = 0; round < rounds; ++round) {
    sums = {};
    std::vector<double> offs;
    for (PatchRow& row : rows) {
      const double off = row.residual + row.by_pose.dot(motion) - row.by_error.dot(errors);
      const double variance = row.noise + 2 * scatter * scatter;
      // Before the pose is known, it may cause half a voxel more.
      const double reach = round == 0 ? resolution / 2 : 0;
      row.weight = tukey_weight(off, std::sqrt(variance + reach * reach)) / variance;
      offs.push_back(std::fabs(off));
      sums.pose += row.weight * row.by_pose * row.by_pose.transpose();
      sums.across += row.weight * row.by_pose * row.by_error.transpose();
      sums.error += row.weight * row.by_error * row.by_error.transpose();
      sums.pose_right += row.weight * row.residual * row.by_pose;
      sums.error_right += row.weight * row.residual * row.by_error;
    }
    // A weak prior: the pose is right within a voxel.
    const TwistCovariance information = sums.pose + TwistCovariance::Identity() / (resolution * resolution);
    motion = information.ldlt().solve((sums.across * errors - sums.pose_right).eval());
    if (round > 0) {
      double noise = 0;
      for (const PatchRow& row : rows) noise += row.noise / static_cast<double>(rows.size());
      const double deviation = geometry::deviation_per_median * geometry::median_of(offs);
      scatter = std::sqrt(std::max(least * least, (deviation * deviation - noise) / 2));
    }
  }
  revisit.scatter_m = scatter;

  const Eigen::SelfAdjointEigenSolver<TwistCovariance> axes(sums.pose);  // ascending
  // Larger errors only: smaller ones do not affect the octree. A direction that one patch alone determines is
  // as wrong as that patch, in every view of it.
  const double enough = 4 / (resolution * resolution);
  const auto is_determined = [&](int axis) {
    double most = 0;
    for (const PatchRow& row : rows) {
      const double along = axes.eigenvectors().col(axis).dot(row.by_pose);
      most = std::max(most, row.weight * along * along);
    }
    return axes.eigenvalues()[axis] - most > enough;
  };
  std::array<int, 6> order{5, 4, 3, 2, 1, 0};
  const auto count = std::stable_partition(order.begin(), order.end(), is_determined) - order.begin();
  revisit.all_directions = axes.eigenvectors()(Eigen::all, order);
  const Twist information = axes.eigenvalues()(order);
  Twist per_metre;
  per_metre << Eigen::Vector3d::Constant(revisit.lever_m), Eigen::Vector3d::Ones();
  const auto along = revisit.all_directions.leftCols(count);
  revisit.directions = along.transpose() * per_metre.asDiagonal();
  revisit.variances = information.head(count).cwiseInverse();
  revisit.motion = -(revisit.variances.asDiagonal() * along.transpose() * sums.pose_right);
  revisit.by_error = -(revisit.variances.asDiagonal() * along.transpose() * sums.across);
  // The part that no motion of the sensor explains.
  const TwistCovariance damped = sums.pose + enough * 1e-3 * TwistCovariance::Identity();
  const TwistCovariance pose_covariance = damped.inverse();
  revisit.error_information = sums.error - sums.across.transpose() * pose_covariance * sums.across;
  revisit.error_vector = sums.error_right - sums.across.transpose() * pose_covariance * sums.pose_right;
  return revisit;
}

void describe(const Revisit& revisit, Alignment& alignment) {
  set_directions(revisit.all_directions, revisit.variances, revisit.lever_m, AlignmentReach(), alignment);
}

}  // namespace octosurf::alignment
