// `octosurf query`: a planner's questions from the shell.
#include "answers.hpp"
#include "geometry/degrees.hpp"
#include "io/exporters/stairs_json.hpp"
#include "open_map.hpp"
#include "query_fields.hpp"
#include "surface_table.hpp"
#include "up_option.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/error.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/ground_patch.hpp>
#include <octosurf/map.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

constexpr const char* query_description = R"(Answers questions about a map.

Examples:
  octosurf query maps/office --nearest 1.2 0.4 0.9
  octosurf query maps/office --nearest 1.2 0.4 0.9 --max-slope 30   of what slopes by 30 degrees at most
  octosurf query maps/office --below 1.2 0.4 0.9 --json             what a foot lowered there meets
  octosurf query maps/office --ray 0 0 1.5 1 0 -0.2                 what a camera at 1.5 m looks at
  octosurf query maps/office --box 0 0 0 2 2 1 --json               ids of the surfaces in there; --sphere X Y Z R
  octosurf query maps/office --voxel 1.2 0.4 0.9                    occupied, free or unknown, and its surface
  octosurf query maps/office --foothold 1.2 0.4 0.0 90 --foot 0.22x0.11 --clearance 0.15 --edge-margin 0.02
  octosurf query maps/office --stair 1.2 0.4 0.0 --json             the stair nearest to that place
  octosurf query maps/office --patch 1.2 0.4 0.6 90                 heights around a robot's base, as its controller reads
  octosurf query maps/office --regions 7 --foot 0.03 --pieces 12 --json   where a ball foot may be on surface 7
  octosurf query maps/office --regions 7 --foot 0.03 --about 1.2 0.4 0.0 --reach 1   likewise, within a metre of a place
)";

struct QueryArguments {
  std::string map, up;
  const MapQuestion* question = nullptr;
  std::vector<double> numbers, stair, patch;  ///< of the question
  AskedOfMap asked;
  bool json = false;
};

void print(const Eigen::Vector3d& v, const char* what) {
  std::printf("%s %.4f %.4f %.4f\n", what, v.x(), v.y(), v.z());
}

void print(const planning::AskedMap& map, const planning::PlaceQuestion& question,
           const planning::PlaceAnswer& found) {
  using planning::PlaceQuestion;
  const bool ray = question.kind == PlaceQuestion::ray;
  if (question.kind == PlaceQuestion::sphere || question.kind == PlaceQuestion::box) {
    std::vector<SurfacePtr> surfaces;
    for (const SurfacePtr& surface : map.snapshot->surfaces)
      if (std::binary_search(found.surfaces.begin(), found.surfaces.end(), surface->id))
        surfaces.push_back(surface);
    print_table(surfaces, map.up);
  } else if (question.kind == PlaceQuestion::voxel) {
    const OccupancyView::Voxel& voxel = found.voxel;
    std::printf("state     %s\n", state_name(voxel.state));
    if (voxel.state != OccupancyView::State::unknown) std::printf("log-odds  %.3f\n", voxel.log_odds);
    if (voxel.surface != 0)
      std::printf("surface   %u\n", voxel.surface);
    else if (voxel.state == OccupancyView::State::occupied)
      std::printf("surface   none yet\n");
  } else if (!found.found) {
    std::printf("nothing   the ray meets no surface\n");
  } else {
    const Surface& surface = map.surface(found.surfaces[0]);
    std::printf("surface   %u%s\n", surface.id,
                !ray          ? ""
                : found.front ? ", from its front"
                              : ", from its back");
    print(found.point, "point    ");
    std::printf("distance  %.4f m\n", found.distance_m);
    if (ray) return;
    print(surface.plane.normal, "normal   ");
    std::printf("slope     %.2f°\n", slope_rad(surface, map.up) * deg_per_rad);
    std::printf("area      %.3f m²\n", surface.area_m2);
  }
}

void print(const planning::FoundFoothold& answer) {
  const Foothold& found = answer.foothold;
  const std::string refused = found.refused ? std::string(contact_refusal_name(*found.refused)) : "";
  std::printf("surface    %u\n", found.surface);
  std::printf("accepted   %s\n", found.accepted ? "yes" : ("no: " + refused).c_str());
  std::printf("supported  %.1f %%\n", 100 * found.supported);
  if (answer.ground[static_cast<std::size_t>(Ground::supported)] < 1) {
    std::printf("ground    ");
    for (std::size_t k = 0; k < ground_names.size(); ++k)
      if (answer.ground[k] > 0) std::printf(" %.0f %% %s", 100 * answer.ground[k], ground_names[k].data());
    std::printf("\n");
  }
  std::printf("margin     %.4f m\n", found.margin_m);
  print(found.T_map_contact.translation(), "point     ");
  print(found.T_map_contact.linear().col(2), "normal    ");
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

/// The stair nearest to a place.
void answer_stair(const planning::AskedMap& map, const QueryArguments& arguments) {
  const GroundView ground = map.bare_ground();
  const std::vector<double>& at = arguments.stair;
  const Stair* stair = nearest_stair(*map.snapshot, ground.stairs().stairs, {at[0], at[1], at[2]});
  if (stair == nullptr) throw Error(Error::Kind::data, arguments.map, "has no stair", "map more of it first");
  if (arguments.json)
    std::printf("%s\n", io::stair_json(*stair).c_str());
  else
    print_table(std::vector<Stair>{*stair});
}

/// The heights about a base at X Y Z, its yaw in degrees.
void answer_patch(const planning::AskedMap& map, const QueryArguments& arguments) {
  const std::vector<double>& at = arguments.patch;
  GroundRules rules = GroundRules::of(Biped{}, map.octree.resolution());
  rules.limits.up = map.up;
  Eigen::Isometry3d T_map_base(upright(map.up).inverse() *
                               Eigen::AngleAxisd(at[3] * rad_per_deg, Eigen::Vector3d::UnitZ()));
  T_map_base.translation() << at[0], at[1], at[2];
  const PatchLayout layout = PatchLayout::grid();
  const GroundPatch patch = ground_patch(map.ground(rules), T_map_base, layout);
  if (arguments.json) {
    std::printf("%s\n", patch_json(layout, patch).c_str());
    return;
  }
  std::printf("heights in cm from the base, seen from above, ahead up: # occupied, v below, . unseen\n");
  for (std::size_t i = layout.points.size(); i-- > 0;) {
    switch (patch.cell[i]) {
      case PatchCell::supported:
        std::printf("%5.0f", 100 * patch.height[i]);
        break;
      case PatchCell::occupied:
        std::printf("    #");
        break;
      case PatchCell::below:
        std::printf("    v");
        break;
      case PatchCell::unseen:
        std::printf("    .");
        break;
    }
    if (i == 0 || layout.points[i - 1].x() < layout.points[i].x()) std::printf("\n");
  }
}

void run_query(const QueryArguments& arguments) {
  const LoadedMap loaded = open_map(arguments.map);
  const std::shared_ptr<const Snapshot> snapshot = loaded.map.snapshot();
  warn_of_up(loaded.map, arguments.up);
  const Eigen::Vector3d up = up_in_force(loaded.map, arguments.up).direction;
  const planning::AskedMap map(arguments.map, snapshot, loaded.map.octree(), up,
                               [&](const Surface& surface) { return label_edges(loaded.map, surface); });
  if (!arguments.stair.empty()) return answer_stair(map, arguments);
  if (!arguments.patch.empty()) return answer_patch(map, arguments);
  const auto tell = [&](const auto& found, const auto& json) {
    arguments.json ? static_cast<void>(std::printf("%s\n", json(found).c_str())) : print(found);
  };
  AskedOfMap asked = arguments.asked;
  auto number = arguments.numbers.begin();
  for (const QuestionField& field : arguments.question->fields(asked))
    if (field.required) {
      const auto first = std::exchange(number, number + static_cast<std::ptrdiff_t>(field.numbers));
      field.put({first, number}, "--" + std::string(arguments.question->name));
    }
  const std::string name = arguments.question->name;
  if (name == "foothold") return tell(planning::find_foothold(map, asked.contact), foothold_json);
  if (name == "regions") return tell(planning::find_region(map, asked.contact), region_json);
  asked.place.max_slope_rad = asked.contact.max_slope_rad.value_or(std::numbers::pi);
  const planning::PlaceAnswer found = planning::answer(map, asked.place);
  require_found(map, asked.place, found);
  if (!arguments.json) return print(map, asked.place, found);
  std::printf("%s\n", place_json(map, asked.place, found).c_str());
}

}  // namespace

void add_query(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("query", query_description);
  const auto arguments = std::make_shared<QueryArguments>();
  verb->add_option("map", arguments->map, "map to ask: name without ending, as given to map -o")->required();
  CLI::Option_group* question = verb->add_option_group("question", "question; one of");
  for (const MapQuestion& one : map_questions()) {
    int numbers = 0;
    for (const QuestionField& field : one.fields(arguments->asked))
      if (field.required) numbers += static_cast<int>(field.numbers);
    question
        ->add_option_function<std::vector<double>>(
            std::string("--") + one.name,
            [arguments, &one](const std::vector<double>& v) {
              arguments->question = &one;
              arguments->numbers = v;
            },
            one.takes + std::string(": ") + one.summary)
        ->expected(numbers);
  }
  question
      ->add_option("--stair", arguments->stair,
                   "X Y Z: the stair nearest to this point: risers, treads, width, heading")
      ->expected(3);
  question
      ->add_option(
          "--patch", arguments->patch,
          "X Y Z YAW: heights of the ground around a robot whose base is there, 32 x 20 cells of 5 cm")
      ->expected(4);
  question->require_option(1);
  add_options(*verb, region_fields(arguments->asked.contact));
  add_up_option(*verb, arguments->up);
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_query(*arguments); });
}

}  // namespace octosurf
