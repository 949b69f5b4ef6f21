// Footholds and contact regions of `octosurf query`.
#include "contact_query.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include <octosurf/boundary.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
constexpr double rad_per_deg = std::numbers::pi / 180;

Json point(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

Json ring(const Surface& surface, const Ring2& vertices) {
  Json points = Json::array();
  for (const Eigen::Vector2d& uv : vertices) points.push_back(point(surface.to_map(uv)));
  return points;
}

struct Asked {
  ContactShape foot;
  ContactLimits limits;
  OccupancyView octree;
};

Asked asked_of(const Map& map, const ContactQuery& query, const Eigen::Vector3d& up, double max_slope_rad) {
  Asked asked{foot_of(query.foot), {}, map.octree()};
  asked.limits.up = up;
  asked.limits.max_slope_rad = max_slope_rad;
  asked.limits.edge_margin_m = query.edge_margin;
  asked.limits.frontier_margin_m = query.frontier_margin;
  asked.limits.obstacle_margin_m = query.obstacle_margin;
  asked.limits.clearance_m = query.clearance;
  asked.limits.gap_depth_m = query.gap_depth;
  return asked;
}

/// Edge kinds take some ms, and are needed for a frontier margin only.
std::vector<PolygonEdges> edges_of(const Map& map, const Surface& surface, const ContactLimits& limits) {
  return limits.frontier_margin_m > 0 ? label_edges(map, surface) : std::vector<PolygonEdges>{};
}

void print(const Foothold& found, bool json) {
  const Eigen::Vector3d at = found.T_map_contact.translation(), normal = found.T_map_contact.linear().col(2);
  const std::string refused = found.refused ? std::string(contact_refusal_name(*found.refused)) : "";
  if (json) {
    Json out;
    out["surface"] = found.surface;
    out["accepted"] = found.accepted;
    out["refused"] = found.refused ? Json(refused) : Json();
    out["supported"] = found.supported;
    out["margin_m"] = found.margin_m;
    out["point"] = point(at);
    out["normal"] = point(normal);
    out["heading"] = point(found.T_map_contact.linear().col(0));
    std::printf("%s\n", out.dump().c_str());
    return;
  }
  std::printf("surface    %u\n", found.surface);
  std::printf("accepted   %s\n", found.accepted ? "yes" : ("no: " + refused).c_str());
  std::printf("supported  %.1f %%\n", 100 * found.supported);
  std::printf("margin     %.4f m\n", found.margin_m);
  std::printf("point      %.4f %.4f %.4f\n", at.x(), at.y(), at.z());
  std::printf("normal     %.4f %.4f %.4f\n", normal.x(), normal.y(), normal.z());
}

void print(const Surface& surface, const ContactRegion& region, const std::vector<ConvexPiece>& pieces,
           bool json) {
  if (json) {
    Json out;
    out["surface"] = region.surface;
    out["revision"] = region.revision;
    out["yaw_deg"] = region.yaw_rad ? Json(*region.yaw_rad / rad_per_deg) : Json();
    out["area_m2"] = region.area_m2;
    out["refused"] = Json::array();
    for (const ContactRefusal refusal : region.refused)
      out["refused"].push_back(contact_refusal_name(refusal));
    out["polygons"] = Json::array();
    for (const Polygon& polygon : region.polygons) {
      Json holes = Json::array();
      for (const Ring2& hole : polygon.holes) holes.push_back(ring(surface, hole));
      out["polygons"].push_back({{"outer", ring(surface, polygon.outer)}, {"holes", holes}});
    }
    out["pieces"] = Json::array();
    for (const ConvexPiece& piece : pieces) {
      Json vertices = Json::array();
      for (const Eigen::Vector3d& v : piece.vertices) vertices.push_back(point(v));
      out["pieces"].push_back(vertices);
    }
    std::printf("%s\n", out.dump().c_str());
    return;
  }
  std::size_t holes = 0;
  for (const Polygon& polygon : region.polygons) holes += polygon.holes.size();
  std::printf("surface  %u, %.3f m²\n", surface.id, surface.area_m2);
  std::printf("region   %.3f m² in %zu parts with %zu holes\n", region.area_m2, region.polygons.size(),
              holes);
  for (const ContactRefusal refusal : region.refused)
    std::printf("refused  %s\n", contact_refusal_name(refusal).data());
  for (const ConvexPiece& piece : pieces) std::printf("piece    of %zu corners\n", piece.vertices.size());
}

}  // namespace

ContactShape foot_of(const std::string& text) {
  const char *begin = text.data(), *end = begin + text.size();
  double length = 0, width = 0;
  const auto [times, bad_length] = std::from_chars(begin, end, length);
  if (bad_length == std::errc() && times == end) return ContactShape::disc(length);
  if (bad_length == std::errc() && *times == 'x') {
    const auto [rest, bad_width] = std::from_chars(times + 1, end, width);
    if (bad_width == std::errc() && rest == end) return ContactShape::rectangle(length, width);
  }
  throw Error(Error::Kind::usage, "--foot", "'" + text + "' is no foot",
              "write LENGTHxWIDTH of a sole, such as 0.22x0.11, or the radius of a disc, in metres");
}

void add_contact_options(CLI::App& verb, CLI::Option_group& question, ContactQuery& query) {
  question
      .add_option(
          "--foothold", query.foothold,
          "X Y Z YAW: what a --foot at this heading (degrees) would stand on, on the surface nearest to "
          "this point, or why it cannot")
      ->expected(4);
  question.add_option(
      "--regions", query.regions,
      "ID: where on this surface the middle of a --foot may be, so that all of it is supported");
  verb.add_option("--foot", query.foot, "LENGTHxWIDTH of a sole, or the radius of a disc, m")
      ->default_val("0.22x0.11");
  verb.add_option("--yaw", query.yaw_deg, "degrees: the heading for --regions; any, if it is not given");
  verb.add_option("--pieces", query.pieces, "the region as so many convex pieces at most, too");
  const auto metres = [&verb](const char* name, double& value, const char* help) {
    verb.add_option(name, value, help)->check(CLI::NonNegativeNumber);
  };
  metres("--edge-margin", query.edge_margin, "m, of a foot to every edge");
  metres("--frontier-margin", query.frontier_margin, "m, to edges that nobody has looked beyond");
  metres("--obstacle-margin", query.obstacle_margin, "m, to what stands there, up to --clearance");
  metres("--clearance", query.clearance, "m over the foot in which nothing may stand or hang; 0: any");
  metres("--gap-depth", query.gap_depth,
         "m: no foot where the space is free from the plane to so far behind it; 0: anywhere");
}

void answer(const Map& map, const std::string& map_name, const ContactQuery& query, const Eigen::Vector3d& up,
            double max_slope_rad, bool json) {
  const std::shared_ptr<const Snapshot> snapshot = map.snapshot();
  const Asked asked = asked_of(map, query, up, max_slope_rad);
  if (query.regions) {
    const Surface* surface = snapshot->find(*query.regions);
    if (surface == nullptr)
      throw Error(Error::Kind::data, map_name, "has no surface " + std::to_string(*query.regions),
                  "octosurf info lists them");
    std::optional<double> yaw;
    if (query.yaw_deg) yaw = *query.yaw_deg * rad_per_deg;
    const std::vector<PolygonEdges> edges = edges_of(map, *surface, asked.limits);
    const ContactRegion region =
        contact_region(*surface, asked.foot, yaw, asked.limits, &asked.octree, &edges);
    print(*surface, region, convex_pieces(*surface, region, query.pieces), json);
    return;
  }
  const Eigen::Vector3d at(query.foothold[0], query.foothold[1], query.foothold[2]);
  const auto found = nearest(*snapshot, at, {up, max_slope_rad});
  if (!found)
    throw Error(Error::Kind::data, map_name, "has no such surfaces",
                "map more scans first, or allow a greater --max-slope");
  const Surface& surface = *snapshot->find(found->id);
  const std::vector<PolygonEdges> edges = edges_of(map, surface, asked.limits);
  print(
      foothold(surface, asked.foot, at, query.foothold[3] * rad_per_deg, asked.limits, &asked.octree, &edges),
      json);
}

}  // namespace octosurf
