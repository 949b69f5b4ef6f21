// Footholds and contact regions of `octosurf query`.
#include "contact_query.hpp"

#include "answers.hpp"
#include "bounds.hpp"
#include "geometry/degrees.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include <octosurf/boundary.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

void print(const planning::FoundFoothold& answer) {
  const Foothold& found = answer.foothold;
  const Eigen::Vector3d at = found.T_map_contact.translation(), normal = found.T_map_contact.linear().col(2);
  const std::string refused = found.refused ? std::string(contact_refusal_name(*found.refused)) : "";
  std::printf("surface    %u\n", found.surface);
  std::printf("accepted   %s\n", found.accepted ? "yes" : ("no: " + refused).c_str());
  std::printf("supported  %.1f %%\n", 100 * found.supported);
  const bool all = answer.ground[static_cast<std::size_t>(Ground::supported)] >= 1;
  if (!all) std::printf("ground    ");
  for (std::size_t k = 0; k < ground_names.size(); ++k)
    if (!all && answer.ground[k] > 0)
      std::printf(" %.0f %% %s", 100 * answer.ground[k], ground_names[k].data());
  if (!all) std::printf("\n");
  std::printf("margin     %.4f m\n", found.margin_m);
  std::printf("point      %.4f %.4f %.4f\n", at.x(), at.y(), at.z());
  std::printf("normal     %.4f %.4f %.4f\n", normal.x(), normal.y(), normal.z());
}

void print(const planning::FoundRegion& found) {
  const auto& [surface, region, pieces] = found;
  std::size_t holes = 0;
  for (const Polygon& polygon : region.polygons) holes += polygon.holes.size();
  std::printf("surface  %u, %.3f m²\n", surface->id, surface->area_m2);
  std::printf("region   %.3f m² in %zu parts with %zu holes\n", region.area_m2, region.polygons.size(),
              holes);
  for (const ContactRefusal refusal : region.refused)
    std::printf("refused  %s\n", contact_refusal_name(refusal).data());
  for (const ConvexPiece& piece : pieces) std::printf("piece    of %zu corners\n", piece.vertices.size());
}

}  // namespace

void add_contact_options(CLI::App& verb, CLI::Option_group& question, ContactQuery& query) {
  question
      .add_option("--foothold", query.foothold,
                  "X Y Z YAW: whether a --foot at this heading (degrees) is supported on the surface nearest "
                  "to this point, or why not")
      ->expected(4);
  question.add_option(
      "--regions", query.regions,
      "ID: where on this surface the middle of a --foot may be for all of it to be supported");
  verb.add_option("--robot", query.robot, "biped or quadruped: whose foot and limits hold")
      ->check(CLI::IsMember({"biped", "quadruped"}))
      ->capture_default_str();
  verb.add_option("--foot", query.foot_text,
                  "LENGTHxWIDTH of a sole, or the radius of a disc, m [the robot's]");
  verb.add_option("--yaw", query.yaw_deg, "heading for --regions, degrees [any heading]");
  verb.add_option("--pieces", query.pieces, "also print the region as at most N convex pieces");
  verb.add_option("--about", query.about, "X Y Z: of the region only what is near this place")->expected(3);
  verb.add_option("--reach", query.reach_m, "m: of the region --about a place, along the surface's axes")
      ->check(more_than(0))
      ->capture_default_str();
  const auto metres = [&verb](const char* name, std::optional<double>& value, const char* help) {
    verb.add_option(name, value, help)->check(at_least(0));
  };
  metres("--edge-margin", query.edge_margin_m, "m: from the foot to every edge [the map's resolution]");
  metres("--frontier-margin", query.frontier_margin_m,
         "m: from the foot to edges beyond which nothing was observed [0]");
  metres("--obstacle-margin", query.obstacle_margin_m,
         "m: from the foot to obstacles up to --clearance [the map's resolution]");
  metres("--clearance", query.clearance_m,
         "m: height over the foot that must be clear; 0: not checked [the robot's height]");
  verb.add_option("--unseen", query.unseen_share,
                  "widest unseen gap that a foot may span, as a share of its narrower side")
      ->check(between(0, 1))
      ->capture_default_str();
  verb.add_flag("--as-mapped", query.as_mapped,
                "outlines of the readings, which are no ground: without margins, clearance and voids");
}

void answer(const planning::AskedMap& map, ContactQuery query, bool json) {
  if (!query.foot_text.empty()) query.foot = planning::foot_of(query.foot_text);
  if (query.yaw_deg) query.yaw_rad = *query.yaw_deg * rad_per_deg;
  if (query.regions) {
    query.surface = *query.regions;
    if (!query.about.empty()) query.at = Eigen::Vector3d(query.about.data());
    const planning::FoundRegion found = planning::find_region(map, query);
    if (!json) return print(found);
    std::printf("%s\n", region_json(*found.surface, found.region, found.pieces).c_str());
  } else {
    query.at = Eigen::Vector3d(query.foothold.data());
    query.yaw_rad = query.foothold[3] * rad_per_deg;
    const planning::FoundFoothold found = planning::find_foothold(map, query);
    if (!json) return print(found);
    std::printf("%s\n", foothold_json(found.foothold, found.ground).c_str());
  }
}

}  // namespace octosurf
