#include "cylinders/cylinder_criterion.hpp"

#include "geometry/degrees.hpp"
#include "geometry/moments.hpp"
#include "geometry/symmetric.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace octosurf::cylinders {
namespace {

/// Voxels, radius: three across. The points of narrower ones are means over more than one side of a square
/// bar, which round it.
constexpr double fewest_voxels = 1.5;
constexpr double shortest = 0.1;  // m, and at least four voxels, and the radius: shorter is a disc or a bead
constexpr double least_span = 60 * rad_per_deg;  // rad: a sixth of the way round; less is a bent sheet
/// Mean of (distance / σ)² at which points spread evenly over ±3σ are as likely as points of the noise:
/// 2 ln(6 / √2π).
constexpr double even_chi2 = 1.745;
/// Nats by which a cylinder explains its points better than flat sides do: a false one in one of 10⁴ places,
/// as of planes. A known one needs no search.
constexpr double log_places = 9;
/// Flat sides' squares per a cylinder's: below, errors that are not noise decide, such as voxels' means at a
/// post's edges.
constexpr double least_facets = 1.1;
/// Share of the side that has readings, beyond chance: a ball meets a cylinder in strips, a third of it.
constexpr double least_coverage = 0.4;
constexpr std::size_t weighed = 2000;  // effort: points that a verdict is made of

}  // namespace

CylinderCriterion::CylinderCriterion(const surfaces::MapView& map)
    : map_(map),
      model_(map.noise, map.grid.resolution()),
      min_points_(static_cast<std::size_t>(map.parameters.min_surface_points())) {}

std::vector<geometry::CylinderSample> CylinderCriterion::samples(std::span<const PointId> points,
                                                                 std::size_t most) const {
  std::vector<geometry::CylinderSample> some;
  for (std::size_t k = 0; k < points.size(); k += points.size() / most + 1) {
    const occupancy::VoxelPoint& p = map_.window[points[k]];
    some.push_back(sample(p.position, p.range_class));
  }
  return some;
}

std::vector<geometry::CylinderSample> CylinderCriterion::samples(
    const surfaces::CylinderModel& cylinder) const {
  std::vector<geometry::CylinderSample> some;
  std::size_t k = 0;
  for (const auto& [key, inlier] : cylinder.inliers)
    if (k++ % (cylinder.inliers.size() / weighed + 1) == 0)
      some.push_back(sample(inlier.position, inlier.range_class));
  return some;
}

bool CylinderCriterion::explains(const geometry::CylinderShape& shape,
                                 std::span<const geometry::CylinderSample> samples) {
  double chi2 = 0;
  for (const geometry::CylinderSample& s : samples) chi2 += std::pow(shape.distance(s.position) / s.sigma, 2);
  return chi2 <= even_chi2 * static_cast<double>(samples.size());
}

std::optional<geometry::CylinderShape> CylinderCriterion::through(std::span<const PointId> bent) const {
  const Eigen::Vector3d first = map_.window[bent.front()].position.cast<double>();
  geometry::Moments moments;
  Eigen::Vector3d view = Eigen::Vector3d::Zero();
  for (const PointId i : bent) {
    moments.add(map_.window[i].position.cast<double>() - first);
    view += map_.window[i].view.cast<double>();
  }
  const Eigen::Vector3d mean = first + moments.mean();
  Eigen::Matrix3d axes = geometry::principal_axes(moments.covariance()).vectors;  // normal, across, along
  if (axes.col(0).dot(view) < 0) axes.col(0) *= -1;
  // Heights over the plane: offset, slopes, curvatures.
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> normal_matrix = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 right_side = Vector6::Zero();
  for (const PointId i : bent) {
    const Eigen::Vector3d p = axes.transpose() * (map_.window[i].position.cast<double>() - mean);
    Vector6 row;
    row << 1, p.y(), p.z(), 0.5 * p.y() * p.y(), p.y() * p.z(), 0.5 * p.z() * p.z();
    normal_matrix.noalias() += row * row.transpose();
    right_side.noalias() += p.x() * row;
  }
  const Vector6 heights = normal_matrix.ldlt().solve(right_side);
  if (!heights.allFinite()) return {};
  Eigen::Matrix2d bend;
  bend << heights[3], heights[4], heights[4], heights[5];
  const geometry::PrincipalAxes2 bends = geometry::principal_axes(bend);
  const double radius = -1 / bends.values[0];
  // A patch determines the radius to a factor of two; the fit refines it.
  if (!(radius > fewest_voxels * map_.grid.resolution() / 2 && radius < 2 * largest_radius)) return {};
  return geometry::CylinderShape{mean + (heights[0] - radius) * axes.col(0),
                                 axes.rightCols<2>() * bends.vectors.col(1), radius};
}

bool CylinderCriterion::convincing(const geometry::CylinderShape& shape,
                                   std::span<const geometry::CylinderSample> samples, bool known) const {
  const double d = map_.grid.resolution();
  if (shape.radius < fewest_voxels * d || shape.radius > largest_radius) return false;
  const geometry::CylinderEvidence e = geometry::weigh(shape, samples);
  const double n = static_cast<double>(samples.size());
  double variance = 0;
  for (const geometry::CylinderSample& s : samples) variance += s.sigma * s.sigma / n;
  // The likelihoods' ratio with a scale of the noise that each hypothesis estimates for itself.
  const double nats = 0.5 * n * std::log(e.facets);
  const bool round = known ? nats > 0 : nats > log_places && e.facets >= least_facets;
  const double chance = std::sqrt(2 / n);  // two deviations of a share of n / 2 cells
  // Straight: its middle and its ends lie off it by less than a reading's noise.
  return e.extent.length() >= std::max({shortest, 4 * d, shape.radius}) && e.extent.span >= least_span &&
         e.scatter * e.scatter <= even_chi2 && round && e.coverage >= least_coverage + chance &&
         std::max(e.bulge, e.taper) <= std::sqrt(variance);
}

}  // namespace octosurf::cylinders
