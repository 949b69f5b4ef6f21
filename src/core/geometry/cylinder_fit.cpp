#include "geometry/cylinder_fit.hpp"

#include "geometry/moments.hpp"
#include "geometry/plane_frame.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace octosurf::geometry {
namespace {

using std::numbers::pi;
constexpr double largest_radius = 2;  // m: beyond it the fit has diverged

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

double cost_of(const CylinderShape& shape, std::span<const CylinderSample> samples) {
  double cost = 0;
  for (const CylinderSample& s : samples) {
    const double f = shape.distance(s.position) / s.sigma;
    cost += f * f;
  }
  return cost;
}

/// The normal equations of one step: two translations of the axis, two tilts, the radius.
void linearise(const CylinderShape& shape, const Eigen::Matrix3d& axes,
               std::span<const CylinderSample> samples, Matrix5d& normal_matrix, Vector5d& right_side) {
  normal_matrix.setZero();
  right_side.setZero();
  for (const CylinderSample& s : samples) {
    const Eigen::Vector3d v = axes.transpose() * (s.position - shape.point);
    const double rho = std::hypot(v.x(), v.y());
    if (rho < 1e-9) continue;
    const double ex = v.x() / rho, ey = v.y() / rho, weight = 1 / (s.sigma * s.sigma);
    Vector5d row;
    row << -ex, -ey, -v.z() * ex, -v.z() * ey, -1;
    normal_matrix.noalias() += weight * row * row.transpose();
    right_side.noalias() -= weight * (rho - shape.radius) * row;
  }
}

/// Weighted sum of squared distances of points in the plane z = 0 to their best line.
double misfit_of(const Moments& m) {
  if (m.count <= 0) return 0;
  const double x = m.sum.x(), y = m.sum.y();
  const double a = m.outer(0, 0) - x * x / m.count, b = m.outer(0, 1) - x * y / m.count,
               c = m.outer(1, 1) - y * y / m.count;
  return std::max(0.0, (a + c) / 2 - std::hypot((a - c) / 2, b));
}

/// The cross-section's points in bins of angle with prefix sums, so that the line of any arc costs O(1).
class CrossSection {
 public:
  static constexpr int bins = 72;

  CrossSection(const CylinderShape& shape, const CylinderExtent& extent,
               std::span<const CylinderSample> samples) {
    const Eigen::Vector3d y = shape.axis.cross(extent.start);
    std::array<Moments, bins> of_bin;
    for (const CylinderSample& s : samples) {
      const Eigen::Vector3d q = shape.from_axis(s.position);
      const double px = q.dot(extent.start), py = q.dot(y);
      double angle = std::atan2(py, px);
      if (angle < 0) angle += 2 * pi;
      const int bin = std::clamp(static_cast<int>(angle / (2 * pi) * bins), 0, bins - 1);
      of_bin[static_cast<std::size_t>(bin)].add({px, py, 0}, 1 / (s.sigma * s.sigma));
    }
    for (std::size_t i = 0; i < bins; ++i) {
      before_[i + 1] = before_[i];
      before_[i + 1].add(of_bin[i]);
    }
  }

  /// Of bins [first, last), within one turn from the start.
  double misfit(int first, int last) const {
    Moments arc = before_[static_cast<std::size_t>(last)];
    arc.add(before_[static_cast<std::size_t>(first)], -1);
    return misfit_of(arc);
  }

  /// The better of: two planes that meet anywhere, four of a quarter turn each.
  double facets() const {
    double best = std::numeric_limits<double>::infinity();
    for (int at = 1; at < bins; ++at) best = std::min(best, misfit(0, at) + misfit(at, bins));
    constexpr int quarter = bins / 4;
    for (int phase = 0; phase < quarter; ++phase) {
      double sum = 0;
      for (int first = phase; first + quarter <= bins; first += quarter)
        sum += misfit(first, first + quarter);
      // The quarter that wraps around the start.
      Moments wrapped = before_[static_cast<std::size_t>(phase)];
      wrapped.add(before_[bins]);
      wrapped.add(before_[static_cast<std::size_t>(bins - quarter + phase)], -1);
      best = std::min(best, sum + (phase > 0 ? misfit_of(wrapped) : 0));
    }
    return best;
  }

 private:
  std::array<Moments, bins + 1> before_;
};

}  // namespace

bool refine(CylinderShape& shape, std::span<const CylinderSample> samples) {
  constexpr int most_steps = 10;
  if (samples.size() < 5) return false;
  double mean = 0;
  for (const CylinderSample& s : samples) mean += shape.height(s.position);
  shape.point += mean / static_cast<double>(samples.size()) * shape.axis;
  double cost = cost_of(shape, samples), damping = 1e-4;
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::Matrix3d axes = plane_axes(shape.axis);
    Matrix5d normal_matrix;
    Vector5d right_side;
    linearise(shape, axes, samples, normal_matrix, right_side);
    bool better = false;
    double gain = 0;
    for (int attempt = 0; attempt < 5 && !better; ++attempt, damping *= 10) {
      Matrix5d damped = normal_matrix;
      damped.diagonal() *= 1 + damping;
      const Vector5d change = damped.ldlt().solve(right_side);
      if (!change.allFinite()) return false;
      CylinderShape next = shape;
      next.point += axes.leftCols<2>() * change.head<2>();
      next.axis = (shape.axis + axes.leftCols<2>() * change.segment<2>(2)).normalized();
      next.radius += change[4];
      if (!(next.radius > 0 && next.radius < largest_radius)) continue;
      const double next_cost = cost_of(next, samples);
      if (next_cost > cost) continue;
      better = true;
      gain = cost - next_cost;
      shape = next;
      cost = next_cost;
    }
    if (!better || gain < 1e-6 * cost) break;
    damping = std::max(1e-7, damping / 100);
  }
  return shape.point.allFinite() && shape.axis.allFinite();
}

CylinderExtent extent_of(const CylinderShape& shape, std::span<const CylinderSample> samples) {
  constexpr int bins = 720;
  const Eigen::Matrix3d axes = plane_axes(shape.axis);
  CylinderExtent extent{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  struct Bin {
    double first = 7, last = -1;  // range of its angles; empty
  };
  std::array<Bin, bins> seen;
  for (const CylinderSample& s : samples) {
    const Eigen::Vector3d v = axes.transpose() * (s.position - shape.point);
    extent.low = std::min(extent.low, v.z());
    extent.high = std::max(extent.high, v.z());
    double angle = std::atan2(v.y(), v.x());
    if (angle < 0) angle += 2 * pi;
    Bin& bin = seen[static_cast<std::size_t>(std::min(bins - 1, static_cast<int>(angle / (2 * pi) * bins)))];
    bin.first = std::min(bin.first, angle);
    bin.last = std::max(bin.last, angle);
  }
  double first = -1, last = -1, widest = 0, start = 0;
  for (const Bin& bin : seen) {
    if (bin.last < 0) continue;
    if (first < 0)
      first = start = bin.first;
    else if (bin.first - last > widest)
      widest = bin.first - last, start = bin.first;
    last = bin.last;
  }
  if (const double round = first + 2 * pi - last; round > widest) widest = round, start = first;
  extent.span = 2 * pi - widest;
  extent.start = axes.col(0) * std::cos(start) + axes.col(1) * std::sin(start);
  return extent;
}

CylinderEvidence weigh(const CylinderShape& shape, std::span<const CylinderSample> samples) {
  CylinderEvidence evidence;
  const CylinderExtent& extent = evidence.extent = extent_of(shape, samples);
  const double middle = (extent.low + extent.high) / 2, half = std::max(extent.length() / 2, 1e-6);
  const double n = static_cast<double>(samples.size()), around = std::max(extent.span * shape.radius, 1e-6);
  const double cell = std::sqrt(2 * 2 * half * around / n);
  const auto columns = static_cast<std::size_t>(around / cell) + 1;
  std::vector<bool> seen((static_cast<std::size_t>(2 * half / cell) + 1) * columns);
  const Eigen::Vector3d y = shape.axis.cross(extent.start);
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  double chi2 = 0;
  for (const CylinderSample& s : samples) {
    const double f = shape.distance(s.position), t = (shape.height(s.position) - middle) / half;
    chi2 += f * f / (s.sigma * s.sigma);
    const Eigen::Vector3d row(1, t, t * t);
    normal_matrix += row * row.transpose();
    right_side += f * row;
    const Eigen::Vector3d q = shape.from_axis(s.position);
    double angle = std::atan2(q.dot(y), q.dot(extent.start));
    if (angle < -1e-9) angle += 2 * pi;
    const auto column = static_cast<std::size_t>(std::max(0.0, angle) * shape.radius / cell);
    seen[std::min(seen.size() - 1, static_cast<std::size_t>((t + 1) * half / cell) * columns + column)] =
        true;
  }
  const Eigen::Vector3d parabola = normal_matrix.ldlt().solve(right_side);
  evidence.scatter = std::sqrt(chi2 / n);
  evidence.coverage =
      static_cast<double>(std::count(seen.begin(), seen.end(), true)) / static_cast<double>(seen.size());
  evidence.bulge = std::fabs(parabola[2]);
  evidence.taper = std::fabs(parabola[1]);
  evidence.facets = CrossSection(shape, extent, samples).facets() / std::max(chi2, 1e-12);
  return evidence;
}

}  // namespace octosurf::geometry
