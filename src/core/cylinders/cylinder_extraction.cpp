#include "cylinders/cylinder_extraction.hpp"

#include "cylinders/ransac.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace octosurf::cylinders {
namespace {

constexpr std::size_t scored_points = 192;  // sample size that suffices to rank hypotheses
constexpr std::size_t fitted_points = 400, weighed_points = 2000;
constexpr std::size_t first_look = 32, fewest_at_first = 3;  // preliminary test, points in random order

}  // namespace

std::vector<CylinderExtraction::Oriented> CylinderExtraction::oriented(std::span<const PointId> region) {
  const Eigen::Vector3f reference = map_.window[region.front()].position;
  std::vector<Oriented> points;
  const std::size_t stride = CylinderRules::stride(region.size(), scored_points);
  for (std::size_t k = 0; k < region.size(); k += stride) {
    const LocalPlane& local = rules_.local_plane(region[k]);
    if (local.known)
      points.push_back({map_.window[region[k]].position - reference, local.normal,
                        static_cast<float>(rules_.tolerance(region[k]))});
  }
  return points;
}

std::optional<CylinderExtraction::Guess> CylinderExtraction::guess(const Oriented& a,
                                                                   const Oriented& b) const {
  Eigen::Vector3f axis = a.normal.cross(b.normal);
  const float sine = axis.norm();
  if (sine < 0.2F) return {};
  axis /= sine;
  const Eigen::Vector3f apart = b.position - a.position, turn = b.normal - a.normal;
  const Eigen::Vector3f across = apart - axis.dot(apart) * axis;
  const float radius = across.dot(turn) / turn.squaredNorm();  // least squares of p = c + r n for both points
  if (!(radius > 0.5F * static_cast<float>(rules_.min_radius()) &&
        radius < 1.5F * static_cast<float>(rules_.max_radius())) ||
      (across - radius * turn).norm() > a.tolerance + b.tolerance)
    return {};
  return Guess{(a.position - radius * a.normal + b.position - radius * b.normal) / 2, axis, radius};
}

/// Points on the lateral surface whose normals face outward; stops once more than `to_beat` are impossible.
std::size_t CylinderExtraction::count(const Guess& guess, std::span<const Oriented> points,
                                      std::size_t to_beat) {
  std::size_t found = 0, left = points.size();
  for (const Oriented& p : points) {
    if (found + left <= to_beat || (points.size() - left == first_look && found < fewest_at_first)) return 0;
    --left;
    const Eigen::Vector3f v = p.position - guess.point;
    const Eigen::Vector3f outward = v - guess.axis.dot(v) * guess.axis;
    const float rho = outward.norm();
    found += std::fabs(rho - guess.radius) <= p.tolerance &&
             p.normal.dot(outward) >= static_cast<float>(CylinderRules::cos_facing) * rho;
  }
  return found;
}

std::optional<geometry::CylinderShape> CylinderExtraction::best_shape(std::span<const PointId> region) {
  constexpr float neighbourhood = 0.5F;  // m
  std::vector<Oriented> points = oriented(region);
  const std::size_t stride = CylinderRules::stride(region.size(), scored_points);
  if (points.size() * stride < rules_.min_points()) return {};
  std::mt19937_64 rng(geometry::PackedKeyHash()(map_.window[region.front()].key.packed()) ^ region.size());
  for (std::size_t k = points.size(); k > 1; --k) std::swap(points[k - 1], points[rng() % k]);
  const auto pick = [&]() -> const Oriented& { return points[rng() % points.size()]; };
  const auto draw = [&] {
    const Oriented& a = pick();
    const Oriented* b = &pick();
    for (int again = 0; again < 4 && (b->position - a.position).norm() > neighbourhood; ++again) b = &pick();
    return guess(a, *b);
  };
  const auto best = ransac<Guess>(
      {.iterations = 200, .drawn = 2, .scored = points.size(), .to_beat = rules_.min_points() / stride / 2},
      draw, [&](const Guess& g, std::size_t to_beat) { return count(g, points, to_beat); });
  if (!best) return {};
  const Eigen::Vector3d reference = map_.window[region.front()].position.cast<double>();
  return geometry::CylinderShape{reference + best->model.point.cast<double>(),
                                 best->model.axis.cast<double>().normalized(), best->model.radius};
}

std::vector<PointId> CylinderExtraction::inliers_of(const geometry::CylinderShape& shape,
                                                    std::span<const PointId> region) {
  std::vector<PointId> inliers;
  for (const PointId i : region)
    if (rules_.fits(shape, i)) inliers.push_back(i);
  return inliers;
}

std::vector<PointId> CylinderExtraction::fullest_stretch(const geometry::CylinderShape& shape,
                                                         std::vector<PointId> inliers) {
  const double h = map_.parameters.max_hole_size();
  const auto height = [&](PointId i) { return shape.height(map_.window[i].position.cast<double>()); };
  std::vector<double> heights;
  for (const PointId i : inliers) heights.push_back(height(i));
  std::sort(heights.begin(), heights.end());
  std::size_t first = 0, best_first = 0, best_last = 0;
  for (std::size_t k = 1; k <= heights.size(); ++k) {
    if (k < heights.size() && heights[k] - heights[k - 1] <= h) continue;
    if (k - first > best_last - best_first) best_first = first, best_last = k;
    first = k;
  }
  const double low = heights[best_first], high = heights[best_last - 1];
  std::erase_if(inliers, [&](PointId i) { return height(i) < low || height(i) > high; });
  return inliers;
}

std::optional<CylinderExtraction::ExtractedCylinder> CylinderExtraction::operator()(
    std::span<const PointId> region) {
  if (region.size() < rules_.min_points()) return {};
  std::optional<geometry::CylinderShape> shape = best_shape(region);
  if (!shape) return {};
  std::vector<PointId> inliers = inliers_of(*shape, region);
  for (int round = 0; round < 3; ++round) {
    if (inliers.size() < rules_.min_points()) return {};
    if (round > 0) inliers = fullest_stretch(*shape, std::move(inliers));
    const auto samples = rules_.samples(
        inliers, CylinderRules::stride(inliers.size(), round == 0 ? scored_points : fitted_points));
    if (!geometry::refine(*shape, samples) || (round == 0 && !rules_.promising(*shape, samples))) return {};
    inliers = inliers_of(*shape, region);
  }
  if (inliers.size() < rules_.min_points()) return {};
  inliers = fullest_stretch(*shape, std::move(inliers));
  if (inliers.size() < rules_.min_points() ||
      !rules_.convincing(
          *shape, rules_.samples(inliers, CylinderRules::stride(inliers.size(), weighed_points)), false))
    return {};
  // Up, or along +x or +y, independent of the points drawn.
  const Eigen::Vector3d& a = shape->axis;
  const double level = 1e-3;
  const double sign = std::fabs(a.z()) > level ? a.z() : std::fabs(a.x()) > level ? a.x() : a.y();
  if (sign < 0) shape->axis = -a;
  return ExtractedCylinder{*shape, std::move(inliers)};
}

}  // namespace octosurf::cylinders
