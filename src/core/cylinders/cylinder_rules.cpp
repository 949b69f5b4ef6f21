#include "cylinders/cylinder_rules.hpp"

#include "geometry/degrees.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::cylinders {
namespace {

constexpr double least_round = 1.1;  // residual squares of planes relative to the cylinder's

/// Rounder than edges and posts: by a quarter of the squares, or by less for very many points (a thin rail's
/// roundness hardly exceeds the noise).
bool round(double facets, std::size_t points) {
  return facets >= 1.25 || (facets >= least_round && static_cast<double>(points) * std::log(facets) >= 40);
}

}  // namespace

CylinderRules::CylinderRules(const surfaces::MapView& map)
    : map_(map),
      normals_(map),
      min_points_(static_cast<std::size_t>(map.parameters.min_surface_points())),
      min_radius_(1.5 * map.parameters.occupancy.resolution),
      min_length_(std::max(0.1, 4 * map.parameters.occupancy.resolution)),
      cell_(map.parameters.max_hole_size() / 2) {}

bool CylinderRules::fits(const geometry::CylinderShape& shape, PointId i) {
  const occupancy::VoxelPoint& p = map_.window[i];
  const Eigen::Vector3d outward = shape.from_axis(p.position.cast<double>());
  const double rho = outward.norm(), misfit = std::fabs(rho - shape.radius);
  const double reach = tolerance(shape, i);
  if (misfit > reach) return false;
  const LocalPlane& local = local_plane(i);
  if (!local.known) return misfit <= reach / 2;
  return local.normal.cast<double>().dot(outward) >= CylinderRules::cos_facing * rho;
}

geometry::CylinderSample CylinderRules::sample(PointId i) {
  const LocalPlane& local = local_plane(i);
  const occupancy::VoxelPoint& p = map_.window[i];
  return {p.position.cast<double>(),
          local.known ? Eigen::Vector3d(local.normal.cast<double>()) : Eigen::Vector3d::Zero(),
          map_.noise.sigma(p.range_class)};
}

std::vector<geometry::CylinderSample> CylinderRules::samples(std::span<const PointId> points,
                                                             std::size_t stride) {
  std::vector<geometry::CylinderSample> all;
  all.reserve(points.size() / stride + 1);
  for (std::size_t k = 0; k < points.size(); k += stride) all.push_back(sample(points[k]));
  return all;
}

bool CylinderRules::promising(const geometry::CylinderShape& shape,
                              std::span<const geometry::CylinderSample> samples) const {
  if (shape.radius < min_radius_ / 2 || shape.radius > 2 * max_radius()) return false;
  const geometry::CylinderEvidence e = geometry::weigh(shape, samples, cell_);
  // Two sums of m squares, of deviation √(2/m) each: the samples determine ln(facets) to 2/√m, and it may be
  // three of these below the convincing value.
  const double doubt = 3 * 2 / std::sqrt(static_cast<double>(samples.size()));
  return e.extent.span >= 40 * rad_per_deg && e.facets * std::exp(doubt) >= least_round;
}

bool CylinderRules::convincing(const geometry::CylinderShape& shape,
                               std::span<const geometry::CylinderSample> samples, bool known) const {
  if (shape.radius < min_radius_ || shape.radius > max_radius()) return false;
  const geometry::CylinderEvidence e = geometry::weigh(shape, samples, cell_);
  const double bend = 0.4 * map_.noise.tolerance(1);
  return e.extent.length() >= std::max(min_length_, shape.radius) &&
         e.extent.span >= (known ? 45 : 60) * rad_per_deg && e.scatter <= (known ? 2.2 : 1.7) &&
         (known ? e.facets >= 1.05 : round(e.facets, samples.size())) && e.bulge <= bend && e.taper <= bend &&
         e.lean <= 0.3 && e.coverage >= (known ? 0.4 : 0.5);
}

}  // namespace octosurf::cylinders
