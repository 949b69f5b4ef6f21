#include "io/exporters/export_formats.hpp"
#include "io/exporters/page_parts.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/history.hpp>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

/// µm and µrad: what can be seen, and no digits more. Throws Error(data).
template <typename Matrix>
Json rounded(const Matrix& matrix, const std::string& what) {
  Json list = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      list.push_back(std::round(finite(matrix(row, column), what) * 1e6) / 1e6);
  return list;
}

struct Outlines {
  std::vector<std::int32_t> u, v;
};

Json surface_json(Outlines& outlines, const PastSurface& surface) {
  const std::string name = "surface " + std::to_string(surface.id);
  Json color = Json::array(), rings = Json::array();
  for (const float c : surface.color) color.push_back(std::round(finite(c, name) * 1e4) / 1e4);
  const auto add_ring = [&](const Ring2& ring) {
    for (const Eigen::Vector2d& at : ring) {
      outlines.u.push_back(page_polygon_steps(at.x(), surface.id));
      outlines.v.push_back(page_polygon_steps(at.y(), surface.id));
    }
    return ring.size();
  };
  for (const Polygon& polygon : surface.polygons) {
    Json sizes = Json::array({add_ring(polygon.outer)});
    for (const Ring2& hole : polygon.holes) sizes.push_back(add_ring(hole));
    rings.push_back(std::move(sizes));
  }
  return {{"id", surface.id},
          {"color", std::move(color)},
          {"pose", rounded(surface.T_map_surface.matrix().topRows<3>(), name)},
          {"area_m2", std::round(finite(surface.area_m2, name) * 1e4) / 1e4},
          {"inliers", surface.inliers},
          {"born", surface.born},
          {"revision", surface.revision},
          {"rings", std::move(rings)}};
}

Json moment_json(Outlines& outlines, const Moment* before, const Moment& now) {
  const MomentChanges changes = changes_of(before, now);
  Json surfaces = Json::array(), cylinders = Json::array();
  for (const PastSurfacePtr& surface : changes.surfaces) surfaces.push_back(surface_json(outlines, *surface));
  for (const CylinderPtr& cylinder : changes.cylinders) cylinders.push_back(page_cylinder_json(*cylinder));
  return {{"revision", now.revision},          {"stamp_s", finite(now.stamp_s, "history")},
          {"surfaces", std::move(surfaces)},   {"gone", changes.gone},
          {"cylinders", std::move(cylinders)}, {"cylinders_gone", changes.cylinders_gone}};
}

}  // namespace

void add_history(PageBlock& block, const History& history) {
  Outlines outlines;
  Json moments = Json::array();
  const Moment* before = nullptr;
  for (const Moment& moment : history.moments()) {
    moments.push_back(moment_json(outlines, before, moment));
    before = &moment;
  }
  block.json["history"] = std::move(moments);
  block.add("history_u", differences(outlines.u));
  block.add("history_v", differences(outlines.v));
}

History fitting_history(const PageMap& map, std::size_t most_bytes) {
  History history = map.history;
  if (!history.belongs_to(*map.snapshot))
    throw Error(Error::Kind::data, "history", "is not of this map", "give the one that was written with it");
  // The last moment of a run is the map.
  if (map.snapshot->revision > 0) history.forget_after(map.snapshot->revision - 1);
  while (!history.moments().empty()) {
    PageBlock block;
    add_history(block, history);
    if (block.encoded().size() <= most_bytes) break;
    if (history.moments().size() == 1) return {};
    history.thin();
  }
  return history;
}

}  // namespace octosurf::io
