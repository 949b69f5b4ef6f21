#include "planning/cell_runs.hpp"

#include "geometry/even_odd.hpp"

#include <cmath>

#include <octosurf/error.hpp>

namespace octosurf::planning {

CellRuns::CellRuns(const std::vector<Polygon>& polygons, double edge) {
  for (const Polygon& polygon : polygons)
    for (const Eigen::Vector2d& p : polygon.outer) box_.extend(p);
  if (box_.isEmpty()) return;
  constexpr double farthest = 1 << 20;  // cells: of a kilometre of plane at 1 mm
  if (!(std::max(box_.max().maxCoeff(), -box_.min().minCoeff()) < farthest * edge))
    throw Error(Error::Kind::usage, "ground", "a surface extends over a million cells from its origin");
  const auto row_of = [edge](double v) {  // of the first middle from there on
    return static_cast<std::int64_t>(std::ceil(v / edge - 0.5));
  };
  first_row_ = row_of(box_.min().y()) - 1;
  // Where rings cross the rows' middles: winding 1 where the inside begins on the way to greater u, else -1.
  struct Crossing {
    std::int32_t row = 0, at = 0, winding = 0;
    bool outer = false;
  };
  std::vector<Crossing> crossings;
  const auto add = [&](const Ring2& ring, bool outer) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[i + 1 < ring.size() ? i + 1 : 0];
      const std::int64_t last = row_of(std::max(a.y(), b.y()));
      for (std::int64_t row = row_of(std::min(a.y(), b.y())) - 1; row <= last; ++row) {
        const double v = (static_cast<double>(row) + 0.5) * edge;
        if (!geometry::crosses(a, b, v)) continue;
        const double at = std::ceil(geometry::crossing(a, b, v) / edge - 0.5);
        crossings.push_back({static_cast<std::int32_t>(row - first_row_), static_cast<std::int32_t>(at),
                             b.y() < a.y() ? 1 : -1, outer});
      }
    }
  };
  for (const Polygon& polygon : polygons) {
    add(polygon.outer, true);
    for (const Ring2& hole : polygon.holes) add(hole, false);
  }
  const auto rows = static_cast<std::size_t>(row_of(box_.max().y()) - first_row_ + 2);
  const std::vector<std::uint32_t> begin =
      sort_by_cell(crossings, rows, [](const Crossing& one) { return static_cast<std::size_t>(one.row); });
  for (std::size_t row = 0; row < rows; ++row) {
    const auto first = crossings.begin() + begin[row], last = crossings.begin() + begin[row + 1];
    std::sort(first, last, [](const Crossing& a, const Crossing& b) { return a.at < b.at; });
    int depth = 0, depth_of_outer = 0;
    for (auto one = first; one != last;) {
      const std::int32_t at = one->at;
      const bool was_inside = depth > 0, was_filled = depth_of_outer > 0;
      for (; one != last && one->at == at; ++one) {
        depth += one->winding;
        depth_of_outer += one->outer ? one->winding : 0;
      }
      if ((depth > 0) != was_inside) inside_.turns.push_back(at);
      if ((depth_of_outer > 0) != was_filled) filled_.turns.push_back(at);
    }
    inside_.begin.push_back(inside_.turns.size());
    filled_.begin.push_back(filled_.turns.size());
  }
}

void CellRuns::mark(const CellRaster& raster, bool filled, Mask& mask) const {
  for (int y = 0; y < raster.size().y(); ++y) {
    const Turns turns = turns_of(raster.low().y() + y, filled ? filled_ : inside_);
    const auto row = mask.begin() + static_cast<std::ptrdiff_t>(y) * raster.size().x();
    const auto column = [&raster](std::int32_t x) {
      return std::clamp(x - raster.low().x(), 0, raster.size().x());
    };
    for (std::size_t i = 0; i + 1 < turns.size(); i += 2)
      std::fill(row + column(turns[i]), row + column(turns[i + 1]), 1);
  }
}

}  // namespace octosurf::planning
