#include "judgement/view.hpp"

#include "geometry/median.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

namespace octosurf::judgement {
namespace {

/// Of a view. A share of 1/2 of 2 · 200 places is known to 2.5 %; with 200 a pair takes 0.1 ms.
constexpr std::size_t most_samples = 200;
/// Cells of an edge: from 1.4° to 11°, within two of which a room has hardly a plane.
constexpr int most_cells = 64, fewest_cells = 8;
/// A sample's neighbours lie within two cells, and five times as far as these two are wide: readings of a
/// floor that is seen at 11° lie so far apart.
constexpr int near_cells = 2;
constexpr float near_widths = 5;
/// For three parameters of a plane and a scatter that is known to a third.
constexpr std::size_t fewest_neighbours = 8;
/// Flat: they spread four times as far along the plane as across it. And not along one line only, whose plane
/// is any plane through it: 1/4.5 as far across the line as along it.
constexpr float flat_variances = 16, line_variances = 0.05F;

/// -45° … 45° in the cells of an edge.
int cell_of_tangent(float tangent, int cells_of_edge) {
  const auto cells = static_cast<float>(cells_of_edge);
  const float share = std::atan(tangent) * static_cast<float>(2 / std::numbers::pi) + 0.5F;
  return std::clamp(static_cast<int>(share * cells), 0, cells_of_edge - 1);
}

Sample sample_at(const View& view, const Eigen::Vector3f& point, Cell cell) {
  Sample sample{point, point.norm(), Eigen::Vector3f::Zero()};
  const float width = near_cells * static_cast<float>(std::numbers::pi / 2 / view.cells_of_edge);
  const float reach = near_widths * width * sample.range;
  std::size_t count = 0;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();
  view.around(cell, near_cells, [&](const Eigen::Vector3f& other) {
    const Eigen::Vector3f off = other - point;  // small numbers, so that floats suffice
    if (off.squaredNorm() >= reach * reach) return;
    ++count;
    sum += off;
    squares += off * off.transpose();
  });
  sample.known = count >= fewest_neighbours;
  if (!sample.known) return sample;
  const Eigen::Vector3f mean = sum / static_cast<float>(count);
  const Eigen::Matrix3f covariance = squares / static_cast<float>(count) - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> axes(covariance);
  const Eigen::Vector3f variances = axes.eigenvalues().cwiseMax(0);
  sample.flat = variances[1] > flat_variances * variances[0] && variances[1] > line_variances * variances[2];
  sample.normal = axes.eigenvectors().col(0);
  sample.scatter = std::sqrt(variances[0]);
  sample.spread = std::sqrt(variances[1] + variances[2]);
  return sample;
}

}  // namespace

std::vector<Eigen::Vector3f> thinned(const std::vector<Eigen::Vector3f>& points) {
  constexpr std::size_t most_readings = 8000;  // two or more to a cell, in 110 kB
  if (points.size() <= most_readings) return points;
  std::vector<Eigen::Vector3f> some;
  for (std::size_t k = 0; k < most_readings; ++k) {
    // Multiples of the golden ratio, lest one column of an image be taken.
    const double place = std::fmod(static_cast<double>(k) * std::numbers::phi, 1);
    some.push_back(points[static_cast<std::size_t>(place * static_cast<double>(points.size()))]);
  }
  return some;
}

Cell View::cell_of(const Eigen::Vector3f& direction) const {
  Eigen::Index axis = 0;
  const float most = direction.cwiseAbs().maxCoeff(&axis);
  if (!(most > 0)) return 0;
  const int face = 2 * static_cast<int>(axis) + (direction[axis] > 0 ? 0 : 1);
  const float u = direction[(axis + 1) % 3] / most, v = direction[(axis + 2) % 3] / most;
  return static_cast<Cell>((face * cells_of_edge + cell_of_tangent(u, cells_of_edge)) * cells_of_edge +
                           cell_of_tangent(v, cells_of_edge));
}

void View::sort_points() {
  std::vector<std::pair<Cell, std::uint32_t>> order;
  for (const Eigen::Vector3f& point : points)
    order.emplace_back(cell_of(point), static_cast<std::uint32_t>(order.size()));
  std::ranges::sort(order);
  std::vector<Eigen::Vector3f> sorted;
  sorted.reserve(points.size());
  cells.clear();
  for (const auto& [cell, index] : order) {
    cells.push_back(cell);
    sorted.push_back(points[index]);
  }
  points = std::move(sorted);
}

void View::finish() {
  std::vector<float> ranges;
  for (const Eigen::Vector3f& point : points) ranges.push_back(point.norm());
  range = ranges.empty() ? 0 : geometry::median_of(ranges);
  const std::size_t count = std::min(most_samples, points.size());
  for (cells_of_edge = most_cells; cells_of_edge >= fewest_cells; cells_of_edge /= 2) {
    sort_points();
    samples.clear();
    for (std::size_t k = 0; k < count; ++k) {  // by cell, and so evenly over what was seen
      const std::size_t at = k * points.size() / count;
      samples.push_back(sample_at(*this, points[at], cells[at]));
    }
    sparse = 2 * static_cast<std::size_t>(std::ranges::count_if(samples, &Sample::known)) < count;
    if (!sparse || cells_of_edge == fewest_cells) break;
  }
}

Eigen::Vector3d View::motion_of(const Eigen::Vector3d& point) const {
  const Eigen::Isometry3d &from = T_map_before.value_or(T_map_view), &to = T_map_after.value_or(T_map_view);
  const double scans = T_map_before && T_map_after ? 2 : 1;
  return (to * point - from * point) / scans;
}

}  // namespace octosurf::judgement
