#include "surfaces/outline_change.hpp"

#include <span>
#include <unordered_set>

namespace octosurf::surfaces {

std::vector<Polygon> polygons_with(const OutlineChange& change) {
  SharedOutline& shared = *change.outline;
  if (shared.broken) shared.outline.recover();
  shared.broken = true;
  std::span<const Eigen::Vector2d> sites = change.sites;
  for (const OutlineChange::Cell& cell : change.cells) {
    shared.outline.set(cell.cell, sites.first(cell.sites));
    sites = sites.subspan(cell.sites);
  }
  if (!change.cells.empty()) shared.polygons = shared.outline.update();
  shared.broken = false;
  std::vector<Polygon> polygons = shared.polygons;
  for (Polygon& polygon : polygons) {
    for (Eigen::Vector2d& p : polygon.outer) p = change.T_surface_outline * p;
    for (Ring2& hole : polygon.holes)
      for (Eigen::Vector2d& p : hole) p = change.T_surface_outline * p;
  }
  return polygons;
}

OutlineChange folded(const std::vector<const OutlineChange*>& newest_first) {
  const OutlineChange& newest = *newest_first[0];
  OutlineChange all{newest.id, newest.outline, newest.T_surface_outline, {}, {}};
  std::unordered_set<std::uint64_t, geometry::PackedKeyHash> newer;
  for (const OutlineChange* change : newest_first) {
    if (change->outline != all.outline) break;  // made anew since
    auto sites = change->sites.begin();
    for (const OutlineChange::Cell& cell : change->cells) {
      const auto end = sites + cell.sites;
      if (newer.insert(cell.cell.packed()).second) {
        all.cells.push_back(cell);
        all.sites.insert(all.sites.end(), sites, end);
      }
      sites = end;
    }
  }
  return all;
}

}  // namespace octosurf::surfaces
