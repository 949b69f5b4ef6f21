#include "evaluation/planar_region.hpp"

#include "geometry/even_odd.hpp"
#include "geometry/rings.hpp"

#include <algorithm>

namespace octosurf::evaluation {
namespace {

constexpr double finest_row = 0.02;  // m: about one edge of an alpha shape
constexpr std::size_t most_rows = 2048;

double squared_distance(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d edge = b - a;
  const double length2 = edge.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(edge) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * edge).squaredNorm();
}

}  // namespace

PlanarRegion::PlanarRegion(const std::vector<Polygon>& polygons) {
  const auto add = [this](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      edges_.push_back({ring[i], ring[(i + 1) % ring.size()]});
      box_.extend(ring[i]);
    }
  };
  for (const Polygon& polygon : polygons) {
    add(polygon.outer);
    for (const Ring2& hole : polygon.holes) add(hole);
  }
  if (edges_.empty()) return;

  const double height = box_.sizes().y();
  const auto rows = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::min(height / finest_row, double{most_rows})), 1, most_rows);
  row_height_ = height > 0 ? height / static_cast<double>(rows) : 1.0;
  row_begin_.assign(rows + 1, 0);
  const auto span = [this](const Edge& edge) {
    const auto [low, high] = std::minmax(edge.a.y(), edge.b.y());
    return std::pair(row_of(low), row_of(high));
  };
  for (const Edge& edge : edges_) {
    const auto [first, last] = span(edge);
    for (std::size_t row = first; row <= last; ++row) ++row_begin_[row + 1];
  }
  for (std::size_t row = 0; row < rows; ++row) row_begin_[row + 1] += row_begin_[row];
  row_edges_.resize(row_begin_.back());
  std::vector<std::size_t> next(row_begin_.begin(), row_begin_.end() - 1);
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const auto [first, last] = span(edges_[i]);
    for (std::size_t row = first; row <= last; ++row) row_edges_[next[row]++] = static_cast<std::uint32_t>(i);
  }
}

std::size_t PlanarRegion::row_of(double v) const {
  const double row = std::floor((v - box_.min().y()) / row_height_);
  return static_cast<std::size_t>(std::clamp(row, 0.0, static_cast<double>(row_begin_.size()) - 2.0));
}

bool PlanarRegion::contains(const Eigen::Vector2d& uv) const {
  if (empty() || !box_.contains(uv)) return false;
  bool inside = false;
  const std::size_t row = row_of(uv.y());
  for (std::size_t i = row_begin_[row]; i < row_begin_[row + 1]; ++i) {
    const Edge& edge = edges_[row_edges_[i]];
    if (geometry::crosses(edge.a, edge.b, uv.y()) && uv.x() < geometry::crossing(edge.a, edge.b, uv.y()))
      inside = !inside;
  }
  return inside;
}

void PlanarRegion::crossings_at(double v, std::vector<double>& u) const {
  u.clear();
  const std::size_t row = row_of(v);
  for (std::size_t i = row_begin_[row]; i < row_begin_[row + 1]; ++i) {
    const Edge& edge = edges_[row_edges_[i]];
    if (geometry::crosses(edge.a, edge.b, v)) u.push_back(geometry::crossing(edge.a, edge.b, v));
  }
  std::sort(u.begin(), u.end());
}

bool PlanarRegion::within(const Eigen::Vector2d& uv, double margin) const {
  if (empty() || box_.squaredExteriorDistance(uv) > margin * margin) return false;
  return contains(uv) || ring_distance(uv, margin) <= margin;
}

double PlanarRegion::ring_distance(const Eigen::Vector2d& uv, double at_most) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (empty()) return infinity;
  double best = at_most * at_most;
  bool found = false;
  const auto look_at = [&](std::size_t row) {
    for (std::size_t i = row_begin_[row]; i < row_begin_[row + 1]; ++i) {
      const Edge& edge = edges_[row_edges_[i]];
      const double distance = squared_distance(uv, edge.a, edge.b);
      if (distance > best) continue;
      best = distance;
      found = true;
    }
  };
  // Rows outward from the point's own; a row whose band is farther off than the best cannot improve it.
  const std::size_t rows = row_begin_.size() - 1;
  std::size_t below = row_of(uv.y());
  std::size_t above = below + 1;
  look_at(below);
  const auto edge_of_row = [this](std::size_t row) {
    return box_.min().y() + static_cast<double>(row) * row_height_;
  };
  for (;;) {
    const double gap_below = below > 0 ? std::max(0.0, uv.y() - edge_of_row(below)) : infinity;
    const double gap_above = above < rows ? std::max(0.0, edge_of_row(above) - uv.y()) : infinity;
    const double gap = std::min(gap_below, gap_above);
    if (gap == infinity || gap * gap > best) break;
    look_at(gap_below <= gap_above ? --below : above++);
  }
  return found ? std::sqrt(best) : infinity;
}

double enclosed_area(const Polygon& polygon) {
  double area = std::abs(geometry::signed_area(polygon.outer));
  for (const Ring2& hole : polygon.holes) area -= std::abs(geometry::signed_area(hole));
  return area;
}

}  // namespace octosurf::evaluation
