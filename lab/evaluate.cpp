// `octosurf-lab evaluate`: scores of a map's surfaces against a truth or a labelled cloud.
#include "evaluation/evaluate.hpp"

#include "bounds.hpp"
#include "evaluation/labels.hpp"
#include "evaluation/stairs.hpp"
#include "evaluation/truth.hpp"
#include "geometry/degrees.hpp"
#include "io/new_file.hpp"
#include "output_files.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

constexpr const char* evaluate_description = R"(Scores a map's surfaces against what is true.

Examples:
  octosurf-lab evaluate maps/office --truth sim/office/truth.json
  octosurf-lab evaluate maps/office --truth sim/office/truth.json --json scores.json
  octosurf-lab evaluate maps/table --labels learn17.pcd

Scores against --truth (exact definitions in lab/evaluation/evaluate.hpp):
  faces found        true faces of which --min-area or more was seen (faces of one plane that lie nearer to each
                     other than h are one, as a foot finds them; pieces seen farther apart are several). Found as
                     one surface: one surface covers 80 % of what was seen of the face and lies on it with 80 %
                     of its own. Split: several that lie on it cover 80 %. Joined: one surface covers 80 % of it
                     and of others besides, which are named below the face. Missed: none of these
  other surfaces     surfaces of that size that are none of these
  area covered       share of what was seen of these faces with a surface at most tol (1.5 voxels, at least
                     2 cm) and 15° off; layers: surfaces upon each other there, 1 is right
  unsafe area        no true face under it: more than tol or 30° off, or a voxel outside the outline
  1 cm off outlines  the same with 1 cm off the true outline instead of a voxel
  area of things gone  of the unsafe area, what was there and is gone
  tilt, distance     of surfaces found as one to their faces: angle, and distance where the face was seen
  edges              distance between outlines of faces and surfaces, where the sensor saw them
  holes kept open    true holes over 0.02 m² and 10 cm wide of which 80 % stayed empty
  stair              steps found, how much was seen of the least seen tread, errors of the mean measures
  stairs invented    those found where the scene has none
True outlines are those of whole faces: what the sensor could not see of a face can be stood on, too.
Curved things are not in the truth: surfaces on them count as other surfaces and unsafe area.
)";

struct EvaluateArguments {
  std::string map, truth, labels, json;
  double min_area = evaluation::EvaluationOptions{}.min_area;
  bool force = false;
};

// These lines are the same for faces and labels.
template <class Scores>
void print_found(const char* name, std::size_t judged, const Scores& scores) {
  std::printf("%-21s %zu of %zu as one surface; %zu split, %zu joined, %zu missed\n", name, scores.correct,
              judged, scores.over_segmented, scores.under_segmented, scores.missed);
}

template <class Scores>
void print_errors(const Scores& scores) {
  std::printf("%-21s mean %.2f°, at most %.2f°\n", "tilt", deg_per_rad * scores.normal_rad.mean,
              deg_per_rad * scores.normal_rad.max);
  std::printf("%-21s mean %.2f mm, at most %.2f mm\n", "distance", 1e3 * scores.offset_m.mean,
              1e3 * scores.offset_m.max);
}

void print(const evaluation::Evaluation& scores) {
  std::printf("%5s  %-28s %9s %8s %8s %8s %8s %9s  %s\n", "face", "name", "seen m²", "covered", "layers",
              "surface", "angle °", "offset mm", "verdict");
  for (const evaluation::FaceScore& face : scores.face_scores) {
    std::printf("%5u  %-28s %8.3f %7.1f%% %8.2f ", face.id, face.name.c_str(), face.visible_m2,
                100 * face.covered, face.multiplicity);
    if (face.surface != 0) {
      std::printf("%8ju %7.2f %9.1f  ", face.surface, deg_per_rad * face.normal_rad, 1e3 * face.offset_m);
    } else {
      std::printf("%8s %7s %9s  ", "-", "-", "-");
    }
    std::printf("%s\n", std::string(name_of(face.verdict)).c_str());
    for (const evaluation::FusedWith& other : face.fused_with)
      std::printf("%7s with %u (%s): turned by %.2f°, up to %.1f mm off its plane\n", "", other.id,
                  other.name.c_str(), deg_per_rad * other.fold.angle_rad, 1e3 * other.fold.offset_m);
  }
  std::printf("\n");
  const double percent = scores.area_m2 > 0 ? 100 / scores.area_m2 : 0;
  print_found("faces found", scores.faces, scores);
  std::printf("%-21s %zu of %zu, %zu of them on a face that has another\n", "other surfaces", scores.noise,
              scores.surfaces, scores.repeated);
  std::printf("%-21s %.2f %% of the %.2f m² seen, in %.3f layers\n", "area covered", 100 * scores.coverage,
              scores.visible_m2, scores.multiplicity);
  std::printf("%-21s %.3f m², %.2f %% of %.2f m²\n", "unsafe area", scores.unsafe_m2,
              percent * scores.unsafe_m2, scores.area_m2);
  std::printf("%-21s %.3f m², %.2f %%\n", "1 cm off outlines", scores.unsafe_at(0),
              percent * scores.unsafe_at(0));
  std::printf("%-21s %.3f m²\n", "area of things gone", scores.ghost_m2);
  print_errors(scores);
  std::printf("%-21s mean %.1f mm, 95 %% within %.1f mm\n", "edges", 1e3 * scores.boundary_m.mean,
              1e3 * scores.boundary_m.p95);
  std::printf("%-21s %zu of %zu\n", "holes kept open", scores.holes_found, scores.holes);
}

void print(const evaluation::StairScores& scores) {
  for (const evaluation::StairScore& stair : scores.stairs) {
    std::printf("%-21s %zu of %zu steps found", "stair", stair.found, stair.steps);
    if (stair.pieces > 1) std::printf(" in %zu pieces", stair.pieces);
    std::printf(", treads seen to %.0f %% or more", 100 * stair.seen);
    if (stair.found > 0)
      std::printf("; riser %+.1f mm, tread %+.1f mm, width %+.1f mm, heading %+.2f°%s", 1e3 * stair.riser_m,
                  1e3 * stair.tread_m, 1e3 * stair.width_m, deg_per_rad * stair.heading_rad,
                  stair.right_kind ? "" : ", wrong course");
    std::printf("\n");
  }
  std::printf("%-21s %zu\n", "stairs invented", scores.invented);
}

void print(const evaluation::LabelEvaluation& scores) {
  std::printf("%6s %9s %8s %8s %8s %8s %8s %9s  %s\n", "label", "points", "rms mm", "covered", "surface",
              "IoU", "angle °", "offset mm", "verdict");
  for (const evaluation::LabelScore& label : scores.label_scores) {
    std::printf("%6u %9zu %8.1f %7.1f%% ", label.label, label.points, 1e3 * label.rms_m, 100 * label.covered);
    if (label.surface != 0) {
      std::printf("%8ju %8.3f %7.2f %9.1f  ", label.surface, label.iou, deg_per_rad * label.normal_rad,
                  1e3 * label.offset_m);
    } else {
      std::printf("%8s %8s %7s %9s  ", "-", "-", "-", "-");
    }
    std::printf("%s\n", std::string(name_of(label.verdict)).c_str());
  }
  std::printf("\n");
  print_found("labels found", scores.labels, scores);
  std::printf("%-21s %zu of %zu\n", "other surfaces", scores.noise, scores.surfaces);
  std::printf("%-21s %.2f %%\n", "points covered", 100 * scores.coverage);
  std::printf("%-21s %.3f\n", "mean IoU", scores.mean_iou);
  if (scores.support_iou) std::printf("%-21s %.3f\n", "IoU of the support", *scores.support_iou);
  print_errors(scores);
}

void require_writable(const EvaluateArguments& arguments) {
  if (arguments.json.empty()) return;
  require_apart("--json", arguments.json, files_of_map(arguments.map));
  require_apart("--json", arguments.json, {arguments.truth, arguments.labels});
  io::NewFile(arguments.json, arguments.force).write([](std::ostream&) {});
}

void write_json(const EvaluateArguments& arguments, const std::string& json) {
  if (arguments.json.empty()) return;
  io::write_file(arguments.json, arguments.force, [&](std::ostream& out) { out << json << '\n'; });
}

template <class Scores>
void report(const Scores& scores, const EvaluateArguments& arguments) {
  print(scores);
  write_json(arguments, to_json(scores));
}

evaluation::LabelEvaluation evaluate_labelled(const Map& map, const std::string& file) {
  const evaluation::LabelledCloud cloud = evaluation::load_labelled_cloud(file);
  std::vector<Eigen::Vector3d> points;
  std::vector<SurfaceId> found;
  for (const Eigen::Vector3f& point : cloud.points) {
    points.push_back(point.cast<double>());
    found.push_back(map.at(points.back()).surface);
  }
  return evaluation::evaluate_labels(cloud, points, found, *map.snapshot());
}

void run_evaluate(const EvaluateArguments& arguments) {
  require_writable(arguments);
  const LoadedMap loaded = load_map(arguments.map);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  if (!arguments.truth.empty()) {
    evaluation::EvaluationOptions options;
    options.min_area = arguments.min_area;
    options.joined_gap = loaded.map.parameters().max_hole_size();
    const evaluation::Truth truth = evaluation::load_truth(arguments.truth);
    const std::shared_ptr<const Snapshot> snapshot = loaded.map.snapshot();
    report(evaluation::evaluate(*snapshot, truth, options), arguments);
    const Eigen::Vector3d up = up_of(loaded.map).direction;
    print(evaluation::evaluate_stairs(find_stairs(*snapshot, up).stairs, truth, up));
  } else {
    report(evaluate_labelled(loaded.map, arguments.labels), arguments);
  }
}

}  // namespace

void add_evaluate(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("evaluate", evaluate_description);
  const auto arguments = std::make_shared<EvaluateArguments>();
  verb->add_option("map", arguments->map, "map to score: name without ending, as given to map -o")
      ->required();
  CLI::Option_group* against = verb->add_option_group("against", "what is true; one of");
  against->add_option("--truth", arguments->truth, "truth.json of a simulated scene");
  against->add_option(
      "--labels", arguments->labels,
      "labelled cloud: PCD with label or intensity (posed by its VIEWPOINT), or a folder with "
      "depth*.png, *labels*.png and *.K (at the map's origin)");
  against->require_option(1);
  verb->add_option("--min-area", arguments->min_area,
                   "m²: faces of which less was seen are not judged (with --truth)")
      ->check(at_least(0))
      ->capture_default_str();
  verb->add_option("--json", arguments->json, "also write the scores to this file");
  verb->add_flag("--force", arguments->force, "overwrite the --json file");
  verb->callback([arguments] { run_evaluate(*arguments); });
}

}  // namespace octosurf
