#include "judgement/common_error.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace octosurf::judgement {
namespace {

/// Fifty for each parameter: fewer scans explain each other by chance. And views, as offsets of one share its
/// pose's error: in each half as many as there are parameters.
constexpr std::size_t fewest_offsets = 450, fewest_views = 18;
/// Huber's: offsets of more than half a voxel count by their size, not by its square.
/// Above four another thing was met.
constexpr double huber_voxels = 0.5, most_voxels = 4;
/// Reweighted solutions; the last changes it by less than a tenth of what it is sure to.
constexpr int rounds = 4;

/// Iteratively reweighted least squares over the offsets that `fits` takes.
template <class Fits>
CommonParameters fitted_to(const std::vector<Offset>& offsets, double resolution, const Fits& fits) {
  const double linear_from = huber_voxels * resolution;
  CommonParameters found = CommonParameters::Zero();
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix<double, 11, 11> information = Eigen::Matrix<double, 11, 11>::Zero();
    CommonParameters right = CommonParameters::Zero();
    double count = 0;
    for (const Offset& offset : offsets) {
      if (!fits(offset)) continue;
      const CommonParameters by = offset.by.cast<double>();
      const double off = std::fabs(offset.distance + by.dot(found));
      const double weight = off < linear_from ? 1 : linear_from / off;
      information.selfadjointView<Eigen::Lower>().rankUpdate(by, weight);
      right -= weight * static_cast<double>(offset.distance) * by;
      ++count;
    }
    // What moves places by less than a thousandth of a metre per unit is not determined, and stays 0.
    information.diagonal().array() += 1e-6 * count;
    found = information.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  }
  return found;
}

}  // namespace

Offset offset_of(const View& from, const Sample& sample, const View& into, const Eigen::Vector3f& seen,
                 float distance) {
  const Eigen::Vector3d n = from.T_map_view.linear() * sample.normal.cast<double>();
  const Eigen::Vector3d p = sample.point.cast<double>(), q = seen.cast<double>();
  // The normal in each view's axes: nᵀ R x = (Rᵀ n)ᵀ x.
  const Eigen::Vector3d n_p = sample.normal.cast<double>(), n_q = into.T_map_view.linear().transpose() * n;
  CommonParameters by;
  by.head<3>() = q.cross(n_q) - p.cross(n_p);
  by.segment<3>(3) = n_q - n_p;
  by[6] = n_q.dot(q) - n_p.dot(p);
  const Eigen::Vector3d across(1, 1, 0);  // a camera looks along z
  by[7] = (into.camera ? n_q.dot(q.cwiseProduct(across)) : 0) -
          (from.camera ? n_p.dot(p.cwiseProduct(across)) : 0);
  by.tail<2>() = (into.camera ? q.z() : 0) * n_q.head<2>() - (from.camera ? p.z() : 0) * n_p.head<2>();
  by[8] = n.dot(into.motion_of(q) - from.motion_of(p));
  return {by.cast<float>(), distance, from.number};
}

CommonParameters fitted(const std::vector<Offset>& offsets, double resolution) {
  return fitted_to(offsets, resolution, [](const Offset&) { return true; });
}

CommonError common_error(std::vector<Offset> offsets, double resolution) {
  CommonError common;
  // Where a camera's axis lies is hardly ever known to what it would take to tell.
  for (Offset& offset : offsets) offset.by.tail<2>().setZero();
  if (offsets.size() < fewest_offsets) return common;
  if (std::ranges::max(offsets, {}, &Offset::view).view + 1 < fewest_views) return common;
  const double most = most_voxels * resolution;
  double as_given = 0, explained = 0;
  for (const std::size_t half : {0, 1}) {
    const auto is_of_half = [half](const Offset& offset) { return offset.view % 2 == half; };
    const CommonParameters found = fitted_to(offsets, resolution, is_of_half);
    for (const Offset& offset : offsets) {
      if (is_of_half(offset)) continue;
      const auto off = static_cast<double>(offset.distance);
      as_given += std::min(std::fabs(off), most);
      explained += std::min(std::fabs(off + offset.by.cast<double>().dot(found)), most);
    }
  }
  common.explains = as_given > 0 ? 1 - explained / as_given : 0;
  const CommonParameters all = fitted(offsets, resolution);
  double squares = 0;
  for (const Offset& offset : offsets) squares += std::pow(offset.by.cast<double>().dot(all), 2);
  common.moves_m = std::sqrt(squares / static_cast<double>(offsets.size()));
  return common;
}

}  // namespace octosurf::judgement
