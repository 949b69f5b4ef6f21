// `octosurf-lab evaluate`: scores of a map's surfaces against a truth or a labelled cloud.
#include "evaluation/evaluate.hpp"

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

Scores against --truth (tol: 1.5 voxels, at least 2 cm, off a plane; exact definitions in
lab/evaluation/evaluate.hpp):
  judged             true faces of which --min-area or more was seen; faces of one plane (0.5°, a quarter of a
                     voxel) nearer to each other than h are one, as a foot finds them
  correct            one surface covers 80 % of the face's seen area and lies on it with 80 % of its own
  over-segmented     several surfaces that each lie on the face cover 80 % of it
  under-segmented    one surface covers 80 % of the face and of others besides: below the face these are
                     named, with their angle to it and how far they are off its plane
  missed             none of these
  noise              surfaces of that size that took part in none of these
  coverage           share of the judged faces' seen area with a surface at most tol and 15° off
  multiplicity       surfaces upon each other where there are any; 1 is right
  unsafe area        no true face under it: more than tol or 30° off, or a voxel outside the outline
  unsafe at 1 cm     the same with 1 cm (1.5 cm) off the true outline in the plane instead of a voxel
    rim              of it, what lies within 5 cm of the outline
    false            of it, what lies farther off, or where no face is; the same at 1 and 1.5 cm
  ghost area         of the unsafe area, what was there and is gone
  normal error       angle between a face's normal and its surface's, over correct faces
  offset error       distance of the face's seen centroid to the surface's plane, over correct faces
  all matched faces  the same two errors over all judged faces that any surface covers
  boundary distance  from the seen part of the true outline to the surface's, over correct faces
  stairs             steps found, how much was seen of the least seen tread, errors of the mean measures;
                     invented: those found where the scene has none that its truth tells of
  holes found        true holes over 0.02 m² and 10 cm wide of which 80 % stayed empty
True outlines are those of whole faces: what the sensor could not see of a face can be stood on, too.
Curved things are not in the truth: surfaces on them count as noise, unsafe and false.
)";

struct EvaluateArguments {
  std::string map, truth, labels, json;
  double min_area = evaluation::EvaluationOptions{}.min_area;
  bool force = false;
};

// The verdicts' line is the same for faces and labels.
template <class Scores>
void print_verdicts(std::size_t judged, const char* things, const Scores& scores) {
  std::printf("%-22s %zu of %zu %s (%zu over-segmented, %zu under-segmented, %zu missed)\n", "correct",
              scores.correct, judged, things, scores.over_segmented, scores.under_segmented, scores.missed);
}

void print(const evaluation::Evaluation& scores) {
  std::printf("%5s  %-28s %9s %8s %8s %8s %8s %9s  %s\n", "face", "name", "seen m²", "covered", "layers",
              "surface", "angle °", "offset mm", "verdict");
  for (const evaluation::FaceScore& face : scores.face_scores) {
    std::printf("%5u  %-28s %8.3f %7.1f%% %8.2f ", face.id, face.name.c_str(), face.visible_m2,
                100 * face.covered, face.multiplicity);
    if (face.surface != 0) {
      std::printf("%8u %7.2f %9.1f  ", face.surface, deg_per_rad * face.normal_rad, 1e3 * face.offset_m);
    } else {
      std::printf("%8s %7s %9s  ", "-", "-", "-");
    }
    std::printf("%s\n", std::string(name_of(face.verdict)).c_str());
    for (const evaluation::FusedWith& other : face.fused_with)
      std::printf("%7s with %u (%s): turned by %.2f°, up to %.1f mm off its plane\n", "", other.id,
                  other.name.c_str(), deg_per_rad * other.fold.angle_rad, 1e3 * other.fold.offset_m);
  }
  std::printf("\n");
  print_verdicts(scores.faces, "faces", scores);
  std::printf("%-22s %zu of %zu surfaces, %zu of them on a face that has another\n", "noise", scores.noise,
              scores.surfaces, scores.repeated);
  std::printf("%-22s %.2f %% of %.2f m² (%.2f %% with small faces)\n", "coverage", 100 * scores.coverage,
              scores.visible_m2, 100 * scores.coverage_all);
  std::printf("%-22s %.3f\n", "multiplicity", scores.multiplicity);
  std::printf("%-22s %.3f m², %.2f %% of %.2f m²\n", "unsafe area", scores.unsafe_m2,
              100 * scores.unsafe_share, scores.area_m2);
  for (std::size_t m = 0; m < evaluation::outline_margins.size(); ++m) {
    const std::string name = "unsafe at " + std::string(m == 0 ? "1 cm" : "1.5 cm");
    const double percent = scores.area_m2 > 0 ? 100 / scores.area_m2 : 0;
    std::printf("%-22s %.3f m², %.2f %%: rim %.2f %%, false %.2f %%\n", name.c_str(), scores.unsafe_at(m),
                percent * scores.unsafe_at(m), percent * scores.rim_m2[m], percent * scores.false_m2);
  }
  std::printf("%-22s %.3f m²\n", "ghost area", scores.ghost_m2);
  std::printf("%-22s mean %.3f°, max %.3f°\n", "normal error", deg_per_rad * scores.normal_rad.mean,
              deg_per_rad * scores.normal_rad.max);
  std::printf("%-22s mean %.2f mm, max %.2f mm\n", "offset error", 1e3 * scores.offset_m.mean,
              1e3 * scores.offset_m.max);
  std::printf("%-22s normal mean %.3f°, max %.3f°; offset mean %.2f mm, max %.2f mm\n", "all matched faces",
              deg_per_rad * scores.normal_all_rad.mean, deg_per_rad * scores.normal_all_rad.max,
              1e3 * scores.offset_all_m.mean, 1e3 * scores.offset_all_m.max);
  std::printf("%-22s mean %.1f mm, 95 %% within %.1f mm\n", "boundary distance", 1e3 * scores.boundary_m.mean,
              1e3 * scores.boundary_m.p95);
  std::printf("%-22s %zu of %zu\n", "holes found", scores.holes_found, scores.holes);
}

void print(const evaluation::StairScores& scores) {
  for (const evaluation::StairScore& stair : scores.stairs) {
    std::printf("%-22s %s, %zu of %zu steps, seen from %.0f %%, in %zu pieces", "stair", stair.kind.c_str(),
                stair.found, stair.steps, 100 * stair.seen, stair.pieces);
    if (stair.found > 0)
      std::printf("; riser %+.1f mm, tread %+.1f mm, width %+.1f mm, heading %+.2f°%s", 1e3 * stair.riser_m,
                  1e3 * stair.tread_m, 1e3 * stair.width_m, deg_per_rad * stair.heading_rad,
                  stair.right_kind ? "" : ", wrong course");
    std::printf("\n");
  }
  std::printf("%-22s %zu\n", "stairs invented", scores.invented);
}

void print(const evaluation::LabelEvaluation& scores) {
  std::printf("%6s %9s %8s %8s %8s %8s %8s %9s  %s\n", "label", "points", "rms mm", "covered", "surface",
              "IoU", "angle °", "offset mm", "verdict");
  for (const evaluation::LabelScore& label : scores.label_scores) {
    std::printf("%6u %9zu %8.1f %7.1f%% ", label.label, label.points, 1e3 * label.rms_m, 100 * label.covered);
    if (label.surface != 0) {
      std::printf("%8u %8.3f %7.2f %9.1f  ", label.surface, label.iou, deg_per_rad * label.normal_rad,
                  1e3 * label.offset_m);
    } else {
      std::printf("%8s %8s %7s %9s  ", "-", "-", "-", "-");
    }
    std::printf("%s\n", std::string(name_of(label.verdict)).c_str());
  }
  std::printf("\n");
  print_verdicts(scores.labels, "labels", scores);
  std::printf("%-22s %zu of %zu surfaces\n", "noise", scores.noise, scores.surfaces);
  std::printf("%-22s %.2f %%\n", "coverage", 100 * scores.coverage);
  std::printf("%-22s %.3f\n", "mean IoU", scores.mean_iou);
  if (scores.support_iou) std::printf("%-22s %.3f\n", "support plane IoU", *scores.support_iou);
  std::printf("%-22s mean %.3f°, max %.3f°\n", "normal error", deg_per_rad * scores.normal_rad.mean,
              deg_per_rad * scores.normal_rad.max);
  std::printf("%-22s mean %.2f mm, max %.2f mm\n", "offset error", 1e3 * scores.offset_m.mean,
              1e3 * scores.offset_m.max);
}

void require_writable(const EvaluateArguments& arguments) {
  if (arguments.json.empty()) return;
  require_apart("--json", arguments.json, files_of_map(arguments.map));
  require_apart("--json", arguments.json, {arguments.truth, arguments.labels});
  io::NewFile(arguments.json, arguments.force).write([](std::ostream&) {});
}

void write_json(const EvaluateArguments& arguments, const std::string& json) {
  if (arguments.json.empty()) return;
  io::NewFile file(arguments.json, arguments.force);
  file.write([&](std::ostream& out) { out << json << '\n'; });
  file.commit();
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
      ->capture_default_str();
  verb->add_option("--json", arguments->json, "also write the scores to this file");
  verb->add_flag("--force", arguments->force, "overwrite the --json file");
  verb->callback([arguments] { run_evaluate(*arguments); });
}

}  // namespace octosurf
