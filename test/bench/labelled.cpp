// Planes of labelled clouds: octosurf beside CGAL's region growing and Efficient RANSAC and the paper's
// pipeline from stock PCL parts, on the same voxels in one run; and with --mosd a real table with its holes.

#include "bench/labelled_failures.hpp"
#include "bench/labelled_methods.hpp"
#include "bench/labelled_support.hpp"
#include "bench/support.hpp"
#include "reference/paper_pipeline.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

constexpr double deg = 180 / std::numbers::pi;

struct Options {
  std::vector<std::string> inputs;
  std::vector<double> resolutions{0.02, 0.01, 0};
  std::vector<std::string> only, set;
  evaluation::LabelOptions judging;
  bool mosd = false, verbose = false;
  std::string json;
};

std::filesystem::path data_file(const char* name) {
  const std::filesystem::path path = std::filesystem::path(OCTOSURF_DATA_DIR) / name;
  if (!std::filesystem::exists(path))
    throw Error(Error::Kind::data, path.string(), "is missing", "name a labelled cloud with --inputs");
  return path;
}

std::vector<std::filesystem::path> inputs_of(const Options& options) {
  if (!options.inputs.empty()) return {options.inputs.begin(), options.inputs.end()};
  if (!options.mosd)
    return {data_file("labelled_synpeb_sample/test_500.pcd"), data_file("labelled_evops_icl")};
  std::vector<std::filesystem::path> files;
  for (const char* setup : {"labelled_mosd/setup_A", "labelled_mosd/setup_B"})
    for (const auto& entry : std::filesystem::directory_iterator(data_file(setup)))
      if (entry.path().extension() == ".pcd") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Named within the folder of data, if it lies there: tables look the same wherever that folder is.
evaluation::LabelledCloud load(const std::filesystem::path& input) {
  evaluation::LabelledCloud cloud = evaluation::load_labelled_cloud(input);
  const std::filesystem::path within = std::filesystem::relative(input, OCTOSURF_DATA_DIR);
  if (!within.empty() && *within.begin() != "..") cloud.name = within.string();
  return cloud;
}

/// 0 asks for the cloud's own: as wide as neighbouring readings are apart, to the next millimetre.
double resolution_for(const evaluation::LabelledCloud& cloud, double asked) {
  return asked > 0 ? asked : std::ceil(natural_spacing(cloud) * 1000) / 1000;
}

Parameters ours_for(const VoxelCloud& cloud, const Options& options) {
  Parameters parameters = parameters_for(cloud);
  for (const std::string& assignment : options.set) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos)
      throw Error(Error::Kind::usage, "--set " + assignment, "has no value", "write --set NAME=VALUE");
    set_parameter(parameters, assignment.substr(0, equals), assignment.substr(equals + 1));
  }
  return parameters;
}

bool wanted(const Options& options, const std::string& method) {
  return options.only.empty() ||
         std::find(options.only.begin(), options.only.end(), method) != options.only.end();
}

/// Ours first; at d below 1 cm the paper's r of 15 cm holds a thousand points and more, and is left out.
std::vector<Segmentation> segment(const VoxelCloud& cloud, const Options& options) {
  constexpr double finest_for_paper = 0.01;
  std::vector<Segmentation> results;
  const Parameters ours = ours_for(cloud, options);
  results.push_back(segment_ours(cloud, ours));
  results.push_back(told_by_polygons(cloud, results.front(), ours.surface_tolerance()));
  results.back().method += ", by polygons";
  if (wanted(options, "growing")) results.push_back(segment_region_growing(cloud));
  if (wanted(options, "ransac")) results.push_back(segment_ransac(cloud));
  const auto paper = [&](Parameters parameters, const std::string& name) {
    parameters.occupancy.max_range = parameters_for(cloud).occupancy.max_range;
    results.push_back(segment_paper(cloud, parameters, name));
  };
  if (wanted(options, "pcl") && cloud.resolution >= finest_for_paper)
    paper(reference::paper_parameters(cloud.resolution), "PCL pipeline, r = 0.15");
  if (wanted(options, "pcl"))
    paper(reference::paper_parameters_small_radius(cloud.resolution), "PCL pipeline, r = 0.06");
  return results;
}

std::vector<std::string> row_of(const Segmentation& segmentation) {
  const evaluation::LabelEvaluation& e = segmentation.evaluation;
  return {segmentation.method,
          std::to_string(e.correct) + "/" + std::to_string(e.labels),
          std::to_string(e.over_segmented) + "/" + std::to_string(e.under_segmented) + "/" +
              std::to_string(e.missed),
          std::to_string(e.noise),
          fixed(e.coverage * 100, 1),
          fixed(e.mean_iou, 3),
          fixed(e.normal_rad.mean * deg, 2),
          fixed(e.normal_rad.max * deg, 2),
          fixed(e.offset_m.mean * 1e3, 2),
          fixed(segmentation.ms, 0),
          segmentation.settings};
}

nlohmann::json json_of(const VoxelCloud& cloud, const Segmentation& segmentation) {
  nlohmann::json json = nlohmann::json::parse(to_json(segmentation.evaluation));
  json["cloud"] = cloud.cloud->name;
  json["resolution"] = cloud.resolution;
  json["method"] = segmentation.method;
  json["settings"] = segmentation.settings;
  json["ms"] = segmentation.ms;
  return json;
}

void planes(const Options& options) {
  nlohmann::json rows = nlohmann::json::array();
  for (const std::filesystem::path& input : inputs_of(options)) {
    const evaluation::LabelledCloud cloud = load(input);
    for (const double asked : options.resolutions) {
      const VoxelCloud voxels = group_by_voxel(cloud, resolution_for(cloud, asked), options.judging);
      const std::vector<Segmentation> results = segment(voxels, options);
      std::printf("\n%s: %zu points, d = %g m%s, %zu voxels\n", cloud.name.c_str(), cloud.points.size(),
                  voxels.resolution, asked > 0 ? "" : " (the readings' own)", voxels.centroids.size());
      TextTable table({"method", "correct", "over/under/missed", "noise", "coverage %", "mean IoU",
                       "normal °", "max", "offset mm", "ms", "best settings"});
      for (const Segmentation& result : results) {
        table.add(row_of(result));
        rows.push_back(json_of(voxels, result));
      }
      std::printf("%s", table.text().c_str());
      if (options.verbose) std::printf("%s", failure_table(voxels, results).c_str());
      std::fflush(stdout);
    }
  }
  if (!options.json.empty()) write_json_file(options.json, rows.dump(1));
}

void support(const Options& options) {
  nlohmann::json rows = nlohmann::json::array();
  TextTable table({"frame", "d mm", "IoU points", "IoU pixels", "grown d/2", "offset mm", "angle °",
                   "even: mm", "°", "rms mm", "layers", "holes"});
  for (const double asked : options.resolutions) {
    for (const std::filesystem::path& input : inputs_of(options)) {
      const evaluation::LabelledCloud cloud = load(input);
      const VoxelCloud voxels = group_by_voxel(cloud, resolution_for(cloud, asked), options.judging);
      const SupportScore score = score_support(voxels, segment_ours(voxels, ours_for(voxels, options)));
      table.add({input.parent_path().filename().string() + "/" + input.stem().string(),
                 fixed(voxels.resolution * 1e3, 0), fixed(score.iou_points, 4), fixed(score.iou_pixels, 4),
                 fixed(score.iou_pixels_grown, 4), fixed(score.offset_m * 1e3, 2),
                 fixed(score.angle_rad * deg, 3), fixed(score.even_offset_m * 1e3, 2),
                 fixed(score.even_angle_rad * deg, 3), fixed(score.rms_m * 1e3, 2),
                 std::to_string(score.layers), std::to_string(score.holes)});
      rows.push_back({{"cloud", cloud.name},
                      {"resolution", voxels.resolution},
                      {"iou_points", score.iou_points},
                      {"iou_pixels", score.iou_pixels},
                      {"iou_pixels_grown", score.iou_pixels_grown},
                      {"offset_m", score.offset_m},
                      {"angle_deg", score.angle_rad * deg},
                      {"even_offset_m", score.even_offset_m},
                      {"even_angle_deg", score.even_angle_rad * deg},
                      {"rms_m", score.rms_m},
                      {"layers", score.layers},
                      {"holes", score.holes}});
    }
    table.rule();
  }
  std::printf(
      "IoU points: by the surface of a point's voxel; pixels: where its ray meets the polygons. Offset and "
      "angle "
      "to the least-squares plane of the label's pixels; even: of its voxels.\n%s",
      table.text().c_str());
  if (!options.json.empty()) write_json_file(options.json, rows.dump(1));
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"planes of labelled clouds: octosurf beside CGAL and PCL"};
  app.add_option("--inputs", options.inputs, "labelled clouds [SynPEB and ICL-NUIM, or mOSD's frames]")
      ->delimiter(',');
  app.add_option("--resolutions", options.resolutions, "d, m; 0: as wide as readings are apart")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--min-points", options.judging.min_points, "of a label that is judged")
      ->capture_default_str();
  app.add_option("--threshold", options.judging.threshold, "Hoover's T")->capture_default_str();
  app.add_flag("--mosd", options.mosd, "the supporting table of mOSD's frames instead; ours alone");
  app.add_option("--only", options.only, "beside octosurf these only: growing, ransac, pcl, none")
      ->delimiter(',');
  app.add_option("--set", options.set, "NAME=VALUE for octosurf; may be repeated");
  app.add_flag("--verbose", options.verbose,
               "list the planes that octosurf has not correct, and who holds them");
  app.add_option("--json", options.json, "write the numbers there");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main(
      [&] { options.mosd ? octosurf::bench::support(options) : octosurf::bench::planes(options); });
}
