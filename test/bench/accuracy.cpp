// How exact the surfaces are on simulated scenes: with default parameters, with the paper's detector from
// PCL's parts, and by CGAL's region growing and Efficient RANSAC, all on the same scans and scored alike.

#include "bench/cgal_planes.hpp"
#include "bench/support.hpp"
#include "evaluation/evaluate.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> scenes{"room", "office", "stairs", "stones"};
  std::vector<std::uint64_t> seeds{1, 2, 3, 4, 5};
  std::string sensor = "depth";
  double resolution = 0.02;
  double noise_scale = 1;
  double drift_m = 0, drift_deg = 0;  // per lap
  std::optional<int> laps;
  std::optional<std::size_t> frames;
  int threads = 1;
  std::vector<std::string> only, set;
  std::optional<double> bridge;  // m, of with_gaps()
  bool verbose = false;
  std::string json;
  bool terrain = false;
};

constexpr double deg = 180 / std::numbers::pi;

/// Drift shows in what is visited again only, so two laps at least.
int laps_of(const Options& options) {
  return options.laps.value_or(options.drift_m > 0 || options.drift_deg > 0 ? 2 : 1);
}

std::string name_of_scene(const std::string& scene) { return std::filesystem::path(scene).stem().string(); }

/// One way to get surfaces from scans.
struct Method {
  std::string name;
  Parameters parameters;
  CgalMethod cgal = nullptr;  ///< in place of a Mapper
};

std::vector<Method> methods_of(const Options& options) {
  Parameters ours;
  ours.occupancy.resolution = options.resolution;
  Method standard{"ours/default", ours};
  set_parameters(standard.parameters, options.set);
  std::vector<Method> methods{standard};
  for (const double radius : {0.15, 0.06})
    methods.push_back({"ours/paper/r=" + fixed(radius, 2), paper_parameters(options.resolution, radius)});
  methods.push_back({"cgal/growing", ours, cgal_region_growing});
  methods.push_back({"cgal/ransac", ours, cgal_efficient_ransac});
  if (!options.only.empty())
    std::erase_if(methods, [&](const Method& method) {
      return std::none_of(options.only.begin(), options.only.end(),
                          [&](const std::string& prefix) { return method.name.starts_with(prefix); });
    });
  if (methods.empty()) throw Error(Error::Kind::usage, "--only", "leaves no method", "try ours or cgal");
  return methods;
}

bool is_wrong(const evaluation::FaceScore& face) {
  return face.verdict != evaluation::TruthVerdict::correct &&
         face.verdict != evaluation::TruthVerdict::not_judged;
}

/// Scores of several recordings, added up.
struct Score {
  std::size_t recordings = 0, faces = 0, correct = 0, over = 0, under = 0, missed = 0, noise = 0;
  double visible_m2 = 0, covered_m2 = 0, layers_m2 = 0, area_m2 = 0, unsafe_m2 = 0;
  double worst_coverage = 1, worst_multiplicity = 0, worst_unsafe = 0;
  std::array<double, evaluation::outline_margins.size()> rim_m2{};
  double false_m2 = 0;
  double normal_sum = 0, normal_max = 0, offset_sum = 0;
  std::size_t matched = 0;
  double normal_all_sum = 0, normal_all_max = 0, offset_all_sum = 0;
  std::size_t scans = 0;
  double ms = 0;
  std::vector<std::string> wrong;  ///< "SEED:FACE" of each judged face that is not correct

  Score() = default;
  Score(const evaluation::Evaluation& e, std::uint64_t seed, std::size_t scan_count, double all_ms)
      : recordings(1),
        faces(e.faces),
        correct(e.correct),
        over(e.over_segmented),
        under(e.under_segmented),
        missed(e.missed),
        noise(e.noise),
        visible_m2(e.visible_m2),
        covered_m2(e.coverage * e.visible_m2),
        layers_m2(e.multiplicity * covered_m2),
        area_m2(e.area_m2),
        unsafe_m2(e.unsafe_m2),
        worst_coverage(e.coverage),
        worst_multiplicity(e.multiplicity),
        worst_unsafe(e.unsafe_share),
        rim_m2(e.rim_m2),
        false_m2(e.false_m2),
        normal_sum(e.normal_rad.mean * static_cast<double>(e.normal_rad.count)),
        normal_max(e.normal_rad.max),
        offset_sum(e.offset_m.mean * static_cast<double>(e.offset_m.count)),
        matched(e.normal_all_rad.count),
        normal_all_sum(e.normal_all_rad.mean * static_cast<double>(e.normal_all_rad.count)),
        normal_all_max(e.normal_all_rad.max),
        offset_all_sum(e.offset_all_m.mean * static_cast<double>(e.offset_all_m.count)),
        scans(scan_count),
        ms(all_ms) {
    for (const evaluation::FaceScore& face : e.face_scores)
      if (is_wrong(face)) wrong.push_back(std::to_string(seed) + ":" + std::to_string(face.id));
  }

  static double ratio(double part, double whole) { return whole > 0 ? part / whole : 0; }
  double correct_share() const { return ratio(static_cast<double>(correct), static_cast<double>(faces)); }
  double coverage() const { return ratio(covered_m2, visible_m2); }
  double multiplicity() const { return ratio(layers_m2, covered_m2); }
  double unsafe_share() const { return ratio(unsafe_m2, area_m2); }
  double normal_mean_deg() const { return ratio(normal_sum, static_cast<double>(correct)) * deg; }
  double offset_mean_mm() const { return ratio(offset_sum, static_cast<double>(correct)) * 1000; }
  double off_share(std::size_t margin) const { return ratio(rim_m2[margin] + false_m2, area_m2); }
  double false_share() const { return ratio(false_m2, area_m2); }
  double normal_all_mean_deg() const { return ratio(normal_all_sum, static_cast<double>(matched)) * deg; }
  double offset_all_mean_mm() const { return ratio(offset_all_sum, static_cast<double>(matched)) * 1000; }
  double ms_per_scan() const { return ratio(ms, static_cast<double>(scans)); }

  void add(const Score& other) {
    recordings += other.recordings;
    faces += other.faces;
    correct += other.correct;
    over += other.over;
    under += other.under;
    missed += other.missed;
    noise += other.noise;
    visible_m2 += other.visible_m2;
    covered_m2 += other.covered_m2;
    layers_m2 += other.layers_m2;
    area_m2 += other.area_m2;
    unsafe_m2 += other.unsafe_m2;
    worst_coverage = std::min(worst_coverage, other.worst_coverage);
    worst_multiplicity = std::max(worst_multiplicity, other.worst_multiplicity);
    worst_unsafe = std::max(worst_unsafe, other.worst_unsafe);
    normal_sum += other.normal_sum;
    normal_max = std::max(normal_max, other.normal_max);
    offset_sum += other.offset_sum;
    for (std::size_t m = 0; m < rim_m2.size(); ++m) rim_m2[m] += other.rim_m2[m];
    false_m2 += other.false_m2;
    matched += other.matched;
    normal_all_sum += other.normal_all_sum;
    normal_all_max = std::max(normal_all_max, other.normal_all_max);
    offset_all_sum += other.offset_all_sum;
    scans += other.scans;
    ms += other.ms;
    wrong.insert(wrong.end(), other.wrong.begin(), other.wrong.end());
  }
};

struct Run {
  Snapshot snapshot;
  double ms = 0;
};

/// CGAL's time is that of normals and planes of all scans' voxels together.
Run run_method(const Method& method, const std::vector<Scan>& scans, const Options& options) {
  Run run;
  if (method.cgal != nullptr) {
    CgalInput input(method.parameters);
    for (const Scan& scan : scans) input.add(scan);
    const CgalPlanes planes = input.planes(method.cgal);
    return {input.snapshot(planes), planes.normals_ms + planes.planes_ms};
  }
  Mapper mapper(method.parameters, options.threads, paper_detector());
  for (const Scan& scan : scans) run.ms += time_ms([&] { mapper.insert(scan); });
  run.ms += time_ms([&] { mapper.drain(); });
  run.snapshot = *mapper.snapshot();
  if (options.bridge) run.snapshot = *with_gaps(run.snapshot, mapper.map().octree(), *options.bridge);
  return run;
}

/// What went wrong in one recording: judged faces that are not correct, and the worst surfaces.
void print_failures(const std::string& title, const evaluation::Evaluation& evaluation) {
  TextTable faces({title, "verdict", "visible m²", "covered", "layers", "surface", "by surface", "of surface",
                   "normal °", "offset mm"});
  bool any = false;
  for (const evaluation::FaceScore& face : evaluation.face_scores) {
    if (!is_wrong(face)) continue;
    faces.add({face.name, std::string(name_of(face.verdict)), fixed(face.visible_m2, 3),
               fixed(face.covered, 2), fixed(face.multiplicity, 2), std::to_string(face.surface),
               fixed(face.by_surface, 2), fixed(face.of_surface, 2), fixed(face.normal_rad * deg, 2),
               fixed(face.offset_m * 1000, 1)});
    any = true;
  }
  if (any) std::printf("%s", faces.text().c_str());
  for (const evaluation::FaceScore& face : evaluation.face_scores)
    for (const evaluation::FusedWith& other : face.fused_with)
      std::printf("%s is one with %s: turned by %.2f°, up to %.1f mm off its plane\n", face.name.c_str(),
                  other.name.c_str(), other.fold.angle_rad * deg, 1000 * other.fold.offset_m);

  TextTable surfaces({title, "area m²", "unsafe m²", "ghost m²", "on face", "share on it"});
  any = false;
  for (const evaluation::SurfaceScore& surface : evaluation.surface_scores) {
    if (surface.unsafe_m2 < 0.03) continue;
    surfaces.add({"surface " + std::to_string(surface.id), fixed(surface.area_m2, 3),
                  fixed(surface.unsafe_m2, 3), fixed(surface.ghost_m2, 3), std::to_string(surface.face),
                  fixed(surface.on_face, 2)});
    any = true;
  }
  if (any) std::printf("%s", surfaces.text().c_str());
}

std::vector<std::string> row_of(const std::string& name, const Score& score) {
  return {name,
          std::to_string(score.correct) + "/" + std::to_string(score.faces),
          fixed(score.correct_share() * 100, 1),
          std::to_string(score.over) + "/" + std::to_string(score.under) + "/" + std::to_string(score.missed),
          std::to_string(score.noise),
          fixed(score.coverage() * 100, 1),
          fixed(score.worst_coverage * 100, 1),
          fixed(score.multiplicity(), 3),
          fixed(score.worst_multiplicity, 3),
          fixed(score.unsafe_share() * 100, 2),
          fixed(score.worst_unsafe * 100, 2),
          fixed(score.off_share(0) * 100, 2),
          fixed(score.off_share(1) * 100, 2),
          fixed(score.false_share() * 100, 2),
          fixed(score.normal_mean_deg(), 2),
          fixed(score.normal_max * deg, 2),
          fixed(score.offset_mean_mm(), 2),
          fixed(score.normal_all_mean_deg(), 2),
          fixed(score.normal_all_max * deg, 2),
          fixed(score.offset_all_mean_mm(), 2),
          fixed(score.ms_per_scan(), 1)};
}

nlohmann::json json_of(const std::string& method, const std::string& scene, const Score& score,
                       const Options& options) {
  return {{"method", method},
          {"scene", scene},
          {"sensor", options.sensor},
          {"resolution", options.resolution},
          {"noise_scale", options.noise_scale},
          {"drift_m", options.drift_m},
          {"drift_deg", options.drift_deg},
          {"laps", laps_of(options)},
          {"seeds", options.seeds},
          {"recordings", score.recordings},
          {"faces", score.faces},
          {"correct", score.correct},
          {"over_segmented", score.over},
          {"under_segmented", score.under},
          {"missed", score.missed},
          {"noise", score.noise},
          {"wrong", score.wrong},
          {"area_m2", score.area_m2},
          {"unsafe_m2", score.unsafe_m2},
          {"coverage", score.coverage()},
          {"worst_coverage", score.worst_coverage},
          {"multiplicity", score.multiplicity()},
          {"worst_multiplicity", score.worst_multiplicity},
          {"unsafe_share", score.unsafe_share()},
          {"worst_unsafe_share", score.worst_unsafe},
          {"unsafe_10mm_share", score.off_share(0)},
          {"unsafe_15mm_share", score.off_share(1)},
          {"rim_10mm_share", score.off_share(0) - score.false_share()},
          {"rim_15mm_share", score.off_share(1) - score.false_share()},
          {"false_share", score.false_share()},
          {"matched", score.matched},
          {"normal_all_mean_deg", score.normal_all_mean_deg()},
          {"normal_all_max_deg", score.normal_all_max * deg},
          {"offset_all_mean_mm", score.offset_all_mean_mm()},
          {"normal_mean_deg", score.normal_mean_deg()},
          {"normal_max_deg", score.normal_max * deg},
          {"offset_mean_mm", score.offset_mean_mm()},
          {"ms_per_scan", score.ms_per_scan()}};
}

/// scores[method][scene]
using Scores = std::vector<std::vector<Score>>;

Scores score_all(const Options& options, const std::vector<Method>& methods) {
  Scores scores(methods.size(), std::vector<Score>(options.scenes.size()));
  for (std::size_t s = 0; s < options.scenes.size(); ++s)
    for (const std::uint64_t seed : options.seeds) {
      simulation::SimulationOptions simulation;
      set_scene(options.scenes[s], simulation);
      simulation.sensor = options.sensor;
      simulation.seed = seed;
      simulation.frames = options.frames;
      simulation.noise_scale = options.noise_scale;
      simulation.drift_m = options.drift_m;
      simulation.drift_rad = options.drift_deg / deg;
      simulation.laps = laps_of(options);
      const Recorded simulated = record(simulation);
      for (std::size_t m = 0; m < methods.size(); ++m) {
        const Run run = run_method(methods[m], simulated.scans, options);
        const evaluation::Evaluation evaluation = evaluation::evaluate(run.snapshot, simulated.truth);
        const std::size_t scan_count = simulated.scans.size();
        scores[m][s].add(Score(evaluation, seed, scan_count, run.ms));
        const std::string title =
            name_of_scene(options.scenes[s]) + " " + std::to_string(seed) + " " + methods[m].name;
        std::fprintf(stderr, "%s: %zu/%zu correct, %.1f ms per scan\n", title.c_str(), evaluation.correct,
                     evaluation.faces, run.ms / static_cast<double>(scan_count));
        if (options.verbose) print_failures(title, evaluation);
      }
    }
  return scores;
}

void body(Options options) {
  if (options.terrain && (options.scenes = terrain_meshes()).empty()) return;
  const std::vector<Method> methods = methods_of(options);
  const Scores scores = score_all(options, methods);

  TextTable table({"scene, method", "correct",    "%",        "over/under/missed",
                   "noise",         "coverage %", "worst",    "layers",
                   "worst",         "unsafe %",   "worst",    "1 cm",
                   "1.5 cm",        "false",      "normal °", "max",
                   "offset mm",     "all: °",     "max",      "mm",
                   "ms/scan"});
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t s = 0; s < options.scenes.size(); ++s) {
    for (std::size_t m = 0; m < methods.size(); ++m) {
      const std::string scene = name_of_scene(options.scenes[s]);
      table.add(row_of(scene + ", " + methods[m].name, scores[m][s]));
      rows.push_back(json_of(methods[m].name, scene, scores[m][s], options));
    }
    table.rule();
  }
  for (std::size_t m = 0; m < methods.size(); ++m) {
    Score total;
    for (const Score& score : scores[m]) total.add(score);
    table.add(row_of("all, " + methods[m].name, total));
    rows.push_back(json_of(methods[m].name, "all", total, options));
  }
  std::printf(
      "%s sensor, d = %g m, noise ×%g, %zu seeds; faces with at least %g m² visible; \"worst\" is "
      "the worst single recording; \"1 cm\", \"1.5 cm\" and \"false\" are unsafe %% off the true outline by "
      "more than that and than 5 cm; \"all\" are errors over all matched faces.\n%s",
      options.sensor.c_str(), options.resolution, options.noise_scale, options.seeds.size(),
      evaluation::EvaluationOptions{}.min_area, table.text().c_str());
  if (laps_of(options) > 1)
    std::printf("The path is walked %d times; poses drift by %g m and %g° a lap.\n", laps_of(options),
                options.drift_m, options.drift_deg);
  if (!options.json.empty()) write_json_file(options.json, rows.dump(1));
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"accuracy on simulated scenes, ours beside the paper's detector and CGAL"};
  auto* scenes = app.add_option("--scenes", options.scenes, "names, or files of meshes")
                     ->delimiter(',')
                     ->capture_default_str();
  app.add_flag(
         "--terrain", options.terrain,
         "the meshes of ../shared/data/terrain_meshes in their place; one seed and 300 scans of each unless "
         "stated")
      ->excludes(scenes);
  auto* seeds = app.add_option("--seeds", options.seeds)->delimiter(',')->capture_default_str();
  app.add_option("--sensor", options.sensor)->capture_default_str();
  app.add_option("--resolution", options.resolution, "d, m")->capture_default_str();
  app.add_option("--noise-scale", options.noise_scale, "times the sensor's noise")->capture_default_str();
  app.add_option("--drift-m", options.drift_m, "m per lap by which the poses slide away");
  app.add_option("--drift-deg", options.drift_deg, "degrees per lap by which they turn");
  app.add_option("--laps", options.laps, "times the path is walked [1; with drift 2]");
  app.add_option("--frames", options.frames, "scans of each recording (default: as many as show the scene)");
  app.add_option("--threads", options.threads, "of Mapper")->check(CLI::PositiveNumber);
  app.add_option("--only", options.only,
                 "methods whose name begins so: ours, ours/default, ours/paper, cgal …")
      ->delimiter(',');
  app.add_option("--set", options.set, "NAME=VALUE for ours/default; may be repeated");
  app.add_option("--bridge", options.bridge,
                 "outlines as exported, unseen gaps of up to so many m bridged; default: as mapped");
  app.add_flag("--verbose", options.verbose, "list faces that are not correct and surfaces that are unsafe");
  app.add_option("--json", options.json, "write the numbers there");
  CLI11_PARSE(app, argc, argv);
  if (options.terrain && seeds->count() == 0) options.seeds = {1};
  if (options.terrain && !options.frames) options.frames = 300;  // a step of 10 to 15 cm each
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
