#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>

#include <octosurf/changes.hpp>
#include <octosurf/error.hpp>
#include <octosurf/queries.hpp>

namespace octosurf {
namespace {

constexpr double same_normal_rad = 20 * std::numbers::pi / 180;

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

/// The octree's state at a place on a surface: an adjacent voxel along its normal may contain the surface.
OccupancyView::State state_at(const OccupancyView& octree, const Eigen::Vector3d& point,
                              const Eigen::Vector3d& normal) {
  for (const int side : {-1, 1})
    if (octree.at(point + side * octree.resolution() * normal).state == OccupancyView::State::occupied)
      return OccupancyView::State::occupied;
  return octree.at(point).state;
}

/// Overlap of one surface with one of the other map's.
struct Shared {
  std::size_t samples = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
};

SurfaceDifference difference(const Surface& surface, const SurfaceIndex& others, double spacing,
                             double tolerance) {
  SurfaceDifference result;
  result.id = surface.id;
  result.area_m2 = surface.area_m2;
  std::map<SurfaceId, Shared> shared;
  std::size_t samples = 0, met = 0, free = 0, unseen = 0;
  const OccupancyView& octree = others.snapshot().octree;
  const SlopeLimit alike{surface.plane.normal, same_normal_rad};
  for (const Polygon& polygon : surface.polygons)
    for_each_sample(polygon, spacing, [&](const Eigen::Vector2d& uv) {
      ++samples;
      const Eigen::Vector3d point = surface.to_map(uv);
      const auto other = others.below(point + tolerance * surface.plane.normal, alike);
      if (!other || other->distance > 2 * tolerance) {
        if (!(octree.resolution() > 0)) return;
        const OccupancyView::State state = state_at(octree, point, surface.plane.normal);
        free += state == OccupancyView::State::free;
        unseen += state == OccupancyView::State::unknown;
        return;
      }
      ++met;
      Shared& with = shared[other->id];
      ++with.samples;
      with.sum += point;
    });
  if (samples == 0) return result;
  const double sample_m2 = surface.area_m2 / static_cast<double>(samples);
  result.free_m2 = sample_m2 * static_cast<double>(free);
  result.unseen_m2 = sample_m2 * static_cast<double>(unseen);
  if (met == 0) return result;
  result.shared_m2 = sample_m2 * static_cast<double>(met);
  const auto most = std::max_element(shared.begin(), shared.end(), [](const auto& a, const auto& b) {
    return a.second.samples < b.second.samples;
  });
  const Surface& other = *others.snapshot().find(most->first);
  const Eigen::Vector3d middle = most->second.sum / static_cast<double>(most->second.samples);
  result.other = other.id;
  result.offset_m = -other.plane.signed_distance(middle) / other.plane.normal.dot(surface.plane.normal);
  result.angle_rad = std::atan2(other.plane.normal.cross(surface.plane.normal).norm(),
                                other.plane.normal.dot(surface.plane.normal));
  return result;
}

std::vector<SurfaceDifference> differences(const Snapshot& snapshot, const Snapshot& other, double spacing,
                                           double tolerance) {
  // Not owned: the index does not outlive this call.
  const SurfaceIndex index(std::shared_ptr<const Snapshot>(std::shared_ptr<void>(), &other));
  std::vector<SurfaceDifference> all;
  for (const SurfacePtr& surface : snapshot.surfaces)
    all.push_back(difference(*surface, index, spacing, tolerance));
  return all;
}

}  // namespace

MapDifference compare_maps(const Snapshot& before, const Snapshot& after, double tolerance) {
  const double spacing = std::max(before.resolution, after.resolution);
  if (tolerance == 0) tolerance = 2 * spacing;
  if (!(tolerance > 0 && std::isfinite(tolerance)))
    throw Error(Error::Kind::usage, "tolerance", "is not a distance", "must be positive and finite");
  if (!(spacing > 0)) throw Error(Error::Kind::usage, "maps", "have no resolution");
  return {differences(before, after, spacing, tolerance), differences(after, before, spacing, tolerance)};
}

}  // namespace octosurf
