#include "support/unshared_area.hpp"

#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <octosurf/queries.hpp>

namespace octosurf::test {
namespace {

/// Calls `visit(uv)` for the points of a square grid that lie in the polygon.
template <class Visit>
void for_each_sample(const Polygon& polygon, double spacing, const Visit& visit) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : polygon.outer) box.extend(corner);
  const auto first = [&](double low) { return std::ceil(low / spacing - 0.5); };
  for (double row = first(box.min().y()); (row + 0.5) * spacing < box.max().y(); ++row) {
    const double v = (row + 0.5) * spacing;
    const std::vector<double> at = planning::crossings(polygon, v);
    for (std::size_t i = 0; i + 1 < at.size(); i += 2)
      for (double column = first(at[i]); (column + 0.5) * spacing < at[i + 1]; ++column)
        visit(Eigen::Vector2d((column + 0.5) * spacing, v));
  }
}

}  // namespace

double unshared_area(const Snapshot& one, const Snapshot& other) {
  const double spacing = std::max(one.resolution, other.resolution), tolerance = 2 * spacing;
  constexpr double same_normal_rad =
      20 * std::numbers::pi / 180;  // more than noise tilts a plane of n points
  const SurfaceIndex others(std::make_shared<const Snapshot>(other));
  double area = 0;
  for (const SurfacePtr& surface : one.surfaces) {
    const SlopeLimit alike{surface->plane.normal, same_normal_rad};
    double samples = 0, alone = 0;
    for (const Polygon& polygon : surface->polygons)
      for_each_sample(polygon, spacing, [&](const Eigen::Vector2d& uv) {
        const auto met = others.below(surface->to_map(uv) + tolerance * surface->plane.normal, alike);
        ++samples;
        alone += !met || met->distance > 2 * tolerance;
      });
    area += samples > 0 ? surface->area_m2 * alone / samples : surface->area_m2;
  }
  return area;
}

double area_of(const Snapshot& snapshot) {
  double area = 0;
  for (const SurfacePtr& surface : snapshot.surfaces) area += surface->area_m2;
  return area;
}

}  // namespace octosurf::test
