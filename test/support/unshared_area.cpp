#include "support/unshared_area.hpp"

#include "planning/cell_runs.hpp"

#include <algorithm>
#include <memory>
#include <numbers>

#include <octosurf/queries.hpp>

namespace octosurf::test {

double unshared_area(const Snapshot& one, const Snapshot& other) {
  const double spacing = std::max(one.resolution, other.resolution), tolerance = 2 * spacing;
  constexpr double same_normal_rad =
      20 * std::numbers::pi / 180;  // more than noise tilts a plane of n points
  const SurfaceIndex others(std::make_shared<const Snapshot>(other));
  double area = 0;
  for (const SurfacePtr& surface : one.surfaces) {
    const SlopeLimit alike{surface->plane.normal, same_normal_rad};
    double samples = 0, alone = 0;
    planning::CellRuns(surface->polygons, spacing).for_each_run([&](auto row, int from, int to) {
      const double v = (static_cast<double>(row) + 0.5) * spacing;
      for (double column = from; column < to; ++column) {
        const Eigen::Vector2d uv((column + 0.5) * spacing, v);
        const auto met = others.below(surface->to_map(uv) + tolerance * surface->plane.normal, alike);
        ++samples;
        alone += !met || met->distance > 2 * tolerance;
      }
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
