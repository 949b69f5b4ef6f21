#include "planning/polygon_index.hpp"

#include "geometry/even_odd.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>

namespace octosurf::planning {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;

struct PolygonIndex::Tree {
  using Point = bg::model::d2::point_xy<double>;
  using Segment = bg::model::segment<Point>;
  bgi::rtree<Segment, bgi::rstar<16>> edges;

  static Eigen::Vector2d vector(const Point& p) { return {p.x(), p.y()}; }
};

PolygonIndex::PolygonIndex(PolygonIndex&&) noexcept = default;
PolygonIndex::~PolygonIndex() = default;

PolygonIndex::PolygonIndex(const std::vector<Polygon>& polygons) {
  std::vector<Tree::Segment> segments;
  for (const Polygon& polygon : polygons)
    for_each_edge(polygon, [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
      edges_.emplace_back(from, to);
      segments.emplace_back(Tree::Point(from.x(), from.y()), Tree::Point(to.x(), to.y()));
      box_.extend(from);
    });
  tree_ = std::make_unique<const Tree>(Tree{decltype(Tree::edges)(segments)});
  if (!edges_.empty()) sort_into_rows();
}

std::size_t PolygonIndex::row_of(double v) const {
  const double row = (v - box_.min().y()) * rows_per_metre_;
  return static_cast<std::size_t>(std::clamp(row, 0.0, static_cast<double>(row_begin_.size() - 2)));
}

/// As many rows as edges, but at least as high as the mean edge: an edge spans few rows.
void PolygonIndex::sort_into_rows() {
  double rise = 0;
  for (const auto& [from, to] : edges_) rise += std::fabs(to.y() - from.y());
  const auto n = static_cast<double>(edges_.size());
  const double height = box_.sizes().y();
  const double rows = rise > 0 && height > 0 ? std::clamp(height / (rise / n), 1.0, n) : 1.0;
  rows_per_metre_ = height > 0 ? rows / height : 0;
  row_begin_.assign(static_cast<std::size_t>(rows) + 2, 0);
  const auto each_row = [&](const auto& visit) {
    for (std::uint32_t i = 0; i < edges_.size(); ++i) {
      const auto [low, high] = std::minmax(edges_[i].first.y(), edges_[i].second.y());
      for (std::size_t row = row_of(low), last = row_of(high); row <= last; ++row) visit(row, i);
    }
  };
  each_row([&](std::size_t row, std::uint32_t) { ++row_begin_[row + 1]; });
  for (std::size_t row = 1; row < row_begin_.size(); ++row) row_begin_[row] += row_begin_[row - 1];
  rows_.resize(row_begin_.back());
  std::vector<std::uint32_t> next(row_begin_.begin(), row_begin_.end() - 1);
  each_row([&](std::size_t row, std::uint32_t i) { rows_[next[row]++] = i; });
}

bool PolygonIndex::contains(const Eigen::Vector2d& point) const {
  if (edges_.empty() || !box_.contains(point)) return false;
  const std::size_t row = row_of(point.y());
  bool inside = false;
  for (std::uint32_t k = row_begin_[row]; k < row_begin_[row + 1]; ++k) {
    const auto& [a, b] = edges_[rows_[k]];
    inside ^= geometry::passes_left_of(point, a, b);
  }
  return inside;
}

std::optional<Eigen::Vector2d> PolygonIndex::closest(const Eigen::Vector2d& point) const {
  if (edges_.empty()) return {};
  if (contains(point)) return point;
  const auto at = tree_->edges.qbegin(bgi::nearest(Tree::Point(point.x(), point.y()), 1));
  return closest_on_segment(Tree::vector(at->first), Tree::vector(at->second), point);
}

void PolygonIndex::for_each_edge_near(
    const Eigen::AlignedBox2d& box,
    const std::function<bool(const Eigen::Vector2d&, const Eigen::Vector2d&)>& visit) const {
  const bg::model::box<Tree::Point> wanted({box.min().x(), box.min().y()}, {box.max().x(), box.max().y()});
  for (auto at = tree_->edges.qbegin(bgi::intersects(wanted)); at != tree_->edges.qend(); ++at)
    if (!visit(Tree::vector(at->first), Tree::vector(at->second))) return;
}

}  // namespace octosurf::planning
