// Planes of labelled clouds: octosurf beside CGAL's region growing and Efficient RANSAC and the paper's
// detector from PCL's parts, on the same voxels in one run; and with --mosd a real table with its holes.

#include "bench/cgal_planes.hpp"
#include "bench/support.hpp"
#include "evaluation/labels.hpp"
#include "evaluation/planar_region.hpp"
#include "sensing/downsample.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

constexpr double deg = 180 / std::numbers::pi;
constexpr double out_of_sight = 100;  // m: labelled clouds are rooms

/// A labelled cloud as every method gets it: grouped by voxels of edge d, and the centroid of each.
struct VoxelCloud {
  const evaluation::LabelledCloud* cloud = nullptr;
  evaluation::LabelOptions judging;        ///< how segmentations of it are scored
  double resolution = 0;                   ///< d, m
  std::vector<Eigen::Vector3d> points;     ///< the cloud's
  std::vector<Eigen::Vector3f> centroids;  ///< one per voxel
  std::vector<std::size_t> voxel_of;       ///< per point, index into centroids
};

/// What one method made of a cloud.
struct Segmentation {
  std::string method, settings;  ///< settings: what was tried for it, e.g. "15°, 5 mm"
  Snapshot snapshot;             ///< planes at least
  std::vector<SurfaceId> found;  ///< per point, the surface of its voxel; 0: none
  double ms = 0;
  evaluation::LabelEvaluation evaluation;
};

struct Options {
  std::vector<std::string> inputs;
  std::vector<double> resolutions{0.02, 0.01};
  std::vector<std::string> only, set;
  evaluation::LabelOptions judging;
  bool mosd = false;
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

Scan scan_of(const evaluation::LabelledCloud& cloud) {
  Scan scan;
  scan.points = cloud.points;
  scan.name = cloud.name;
  return scan;
}

VoxelCloud group_by_voxel(const evaluation::LabelledCloud& cloud, double resolution,
                          const evaluation::LabelOptions& judging) {
  VoxelCloud result;
  result.cloud = &cloud;
  result.resolution = resolution;
  result.judging = judging;
  const geometry::VoxelGrid grid(resolution);
  sensing::Downsampler downsampler(grid);
  const sensing::VoxelScan voxels = downsampler(scan_of(cloud), 0, out_of_sight);
  for (const sensing::EndVoxel& end : voxels.ends) result.centroids.push_back(end.centroid);
  for (const Eigen::Vector3f& point : cloud.points) {
    geometry::VoxelKey key;
    grid.key_of(point, key);
    result.points.push_back(point.cast<double>());
    result.voxel_of.push_back(static_cast<std::size_t>(downsampler.find(key)));
  }
  return result;
}

Parameters parameters_for(const VoxelCloud& cloud) {
  Parameters parameters;
  parameters.occupancy.resolution = cloud.resolution;
  parameters.occupancy.max_range = out_of_sight;
  return parameters;
}

Parameters ours_for(const VoxelCloud& cloud, const Options& options) {
  Parameters parameters = parameters_for(cloud);
  set_parameters(parameters, options.set);
  return parameters;
}

/// The surface of each point: nearest plane of those at most `tolerance` away whose polygon contains the
/// point's foot or has a ring within `margin` of it.
std::vector<SurfaceId> by_polygons(const Snapshot& snapshot, const std::vector<Eigen::Vector3d>& points,
                                   double tolerance, double margin) {
  std::vector<SurfaceId> found(points.size(), 0);
  std::vector<double> nearest(points.size(), tolerance);
  for (const SurfacePtr& surface : snapshot.surfaces) {
    const evaluation::PlanarRegion region(surface->polygons);
    const Eigen::Isometry3d to_surface = surface->T_map_surface.inverse();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double distance = std::abs(surface->plane.signed_distance(points[i]));
      if (distance > nearest[i]) continue;
      if (!region.within((to_surface * points[i]).head<2>(), margin)) continue;
      nearest[i] = distance;
      found[i] = surface->id;
    }
  }
  return found;
}

/// Regions of centroids as surfaces 1, 2, …
Segmentation from_regions(const VoxelCloud& cloud, const CgalPlanes& planes) {
  Segmentation result;
  result.ms = planes.normals_ms + planes.planes_ms;
  result.snapshot.resolution = cloud.resolution;
  std::vector<SurfaceId> of_voxel(cloud.centroids.size(), 0);
  for (const auto& region : planes.regions) {
    auto surface = std::make_shared<Surface>();
    surface->id = static_cast<SurfaceId>(result.snapshot.surfaces.size() + 1);
    surface->plane = least_squares_plane(cloud.centroids, region).plane;
    surface->inliers = region.size();
    for (const std::size_t i : region) of_voxel[i] = surface->id;
    result.snapshot.surfaces.push_back(std::move(surface));
  }
  for (const std::size_t voxel : cloud.voxel_of) result.found.push_back(of_voxel[voxel]);
  return result;
}

void judge(const VoxelCloud& cloud, Segmentation& result) {
  result.evaluation =
      evaluation::evaluate_labels(*cloud.cloud, cloud.points, result.found, result.snapshot, cloud.judging);
}

/// The best of several settings of CGAL's manual and examples, chosen in the method's favour: tolerance 5 mm,
/// 10 mm and octosurf's s; least size octosurf's n.
Segmentation best_of(const VoxelCloud& cloud, const std::string& method, CgalMethod find_planes,
                     const std::vector<double>& angles_rad, const std::vector<double>& gaps) {
  const Parameters parameters = parameters_for(cloud);
  CgalSettings settings;
  settings.min_points = static_cast<std::size_t>(parameters.min_surface_points());
  const auto rank = [](const Segmentation& s) {
    return std::pair(s.evaluation.correct, -static_cast<double>(s.evaluation.noise));
  };
  Segmentation best;
  for (const double tolerance : {0.005, 0.010, parameters.surface_tolerance()})
    for (const double angle_rad : angles_rad)
      for (const double gap : gaps) {
        settings.tolerance = tolerance;
        settings.angle_rad = angle_rad;
        settings.gap = gap;
        Segmentation result = from_regions(cloud, find_planes(cloud.centroids, settings));
        result.method = method;
        result.settings = fixed(angle_rad * deg, 0) + "°, " + fixed(tolerance * 1e3, 0) + " mm, gap " +
                          fixed(gap * 1e3, 0) + " mm";
        judge(cloud, result);
        if (best.found.empty() || rank(result) > rank(best)) best = std::move(result);
      }
  return best;
}

Segmentation segment_ours(const VoxelCloud& cloud, const Parameters& parameters,
                          const std::string& name = "octosurf") {
  Segmentation result;
  result.method = name;
  Mapper mapper(parameters, 1, paper_detector());
  const Scan scan = scan_of(*cloud.cloud);
  result.ms = time_ms([&] {
    mapper.insert(scan);
    mapper.drain();
  });
  result.snapshot = *mapper.snapshot();
  for (const Eigen::Vector3d& point : cloud.points) result.found.push_back(mapper.map().at(point).surface);
  judge(cloud, result);
  return result;
}

Segmentation told_by_polygons(const VoxelCloud& cloud, const Segmentation& segmentation, double tolerance) {
  Segmentation result = segmentation;
  result.found = by_polygons(result.snapshot, cloud.points, tolerance, cloud.resolution / 2);
  judge(cloud, result);
  return result;
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
  const double h = ours.max_hole_size();
  if (wanted(options, "growing"))
    results.push_back(best_of(cloud, "CGAL region growing", cgal_region_growing, {15 / deg, 25 / deg}, {h}));
  if (wanted(options, "ransac"))
    results.push_back(best_of(cloud, "CGAL Efficient RANSAC", cgal_efficient_ransac,
                              {std::acos(0.87), std::acos(0.95)}, {2.5 * cloud.resolution, h}));
  for (const double radius : {0.15, 0.06}) {
    if (!wanted(options, "paper") || (radius > 0.1 && cloud.resolution < finest_for_paper)) continue;
    Parameters paper = paper_parameters(cloud.resolution, radius);
    paper.occupancy.max_range = out_of_sight;
    results.push_back(segment_ours(cloud, paper, "`detector = paper`, r = " + fixed(radius, 2)));
  }
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
    for (const double resolution : options.resolutions) {
      const VoxelCloud voxels = group_by_voxel(cloud, resolution, options.judging);
      const std::vector<Segmentation> results = segment(voxels, options);
      std::printf("\n%s: %zu points, d = %g m, %zu voxels\n", cloud.name.c_str(), cloud.points.size(),
                  resolution, voxels.centroids.size());
      TextTable table({"method", "correct", "over/under/missed", "noise", "coverage %", "mean IoU",
                       "normal °", "max", "offset mm", "ms", "best settings"});
      for (const Segmentation& result : results) {
        table.add(row_of(result));
        rows.push_back(json_of(voxels, result));
      }
      std::printf("%s", table.text().c_str());
      std::fflush(stdout);
    }
  }
  if (!options.json.empty()) write_json_file(options.json, rows.dump(1));
}

/// How well one surface is the support (a table) of a labelled cloud seen from the origin.
struct SupportScore {
  /// Intersection over union of two sets of labelled points: label 1, and those whose voxel is the
  /// surface's.
  double iou_points = 0;
  /// The same as one sees it, pixel by pixel: label 1, and the pixels whose ray meets the surface's
  /// polygons. What lies on the table hides what is behind it, so polygons that run on under or behind a
  /// thing count against the surface.
  double iou_pixels = 0;
  double offset_m = 0;     ///< signed: label's centroid to the surface's plane
  double angle_rad = 0;    ///< between the surface's plane and the least-squares plane of the label
  double rms_m = 0;        ///< of the label's points to their least-squares plane
  std::size_t layers = 0;  ///< surfaces with at least 2 % of the support's points
  std::size_t holes = 0;   ///< rings inside its polygons
};

constexpr std::uint32_t support = 1;
constexpr double worth_a_layer = 0.02;

/// Intersection over union of the support's points and those that `in` is true of, over labelled points.
template <class In>
double iou(const VoxelCloud& cloud, const In& in) {
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const std::uint32_t label = cloud.cloud->labels[i];
    if (label == 0) continue;
    const bool found = in(i);
    both += found && label == support;
    either += found || label == support;
  }
  return either == 0 ? 0 : static_cast<double>(both) / static_cast<double>(either);
}

std::size_t count_layers(const VoxelCloud& cloud, const std::vector<SurfaceId>& found) {
  std::map<SurfaceId, std::size_t> points;
  std::size_t all = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (cloud.cloud->labels[i] != support) continue;
    ++all;
    if (found[i] != 0) ++points[found[i]];
  }
  std::size_t layers = 0;
  for (const auto& [id, count] : points)
    layers += static_cast<double>(count) >= worth_a_layer * static_cast<double>(all);
  return layers;
}

const evaluation::LabelScore& label_score(const evaluation::LabelEvaluation& evaluation) {
  for (const evaluation::LabelScore& score : evaluation.label_scores)
    if (score.label == support) return score;
  throw Error(Error::Kind::data, "labels", "no point belongs to the support", "label 1 is expected");
}

SupportScore score_support(const VoxelCloud& cloud, const Segmentation& segmentation) {
  const evaluation::LabelScore& label = label_score(segmentation.evaluation);
  SupportScore score;
  score.rms_m = label.rms_m;
  score.layers = count_layers(cloud, segmentation.found);
  const Surface* surface = segmentation.snapshot.find(label.surface);
  if (surface == nullptr) return score;
  score.offset_m = label.offset_m;
  score.angle_rad = label.normal_rad;
  for (const Polygon& polygon : surface->polygons) score.holes += polygon.holes.size();

  score.iou_points = iou(cloud, [&](std::size_t i) { return segmentation.found[i] == label.surface; });
  const evaluation::PlanarRegion region(surface->polygons);
  const Eigen::Isometry3d to_surface = surface->T_map_surface.inverse();
  const auto ray_meets = [&](std::size_t i) {
    const double stretch = surface->plane.offset / surface->plane.normal.dot(cloud.points[i]);
    if (!(std::isfinite(stretch) && stretch > 0)) return false;
    return region.within((to_surface * (stretch * cloud.points[i])).head<2>(), 0);
  };
  score.iou_pixels = iou(cloud, ray_meets);
  return score;
}

void support_scores(const Options& options) {
  nlohmann::json rows = nlohmann::json::array();
  TextTable table(
      {"frame", "d mm", "IoU points", "IoU pixels", "offset mm", "angle °", "rms mm", "layers", "holes"});
  for (const double resolution : options.resolutions) {
    for (const std::filesystem::path& input : inputs_of(options)) {
      const evaluation::LabelledCloud cloud = load(input);
      const VoxelCloud voxels = group_by_voxel(cloud, resolution, options.judging);
      const SupportScore score = score_support(voxels, segment_ours(voxels, ours_for(voxels, options)));
      table.add({input.parent_path().filename().string() + "/" + input.stem().string(),
                 fixed(voxels.resolution * 1e3, 0), fixed(score.iou_points, 4), fixed(score.iou_pixels, 4),
                 fixed(score.offset_m * 1e3, 2), fixed(score.angle_rad * deg, 3), fixed(score.rms_m * 1e3, 2),
                 std::to_string(score.layers), std::to_string(score.holes)});
      rows.push_back({{"cloud", cloud.name},
                      {"resolution", voxels.resolution},
                      {"iou_points", score.iou_points},
                      {"iou_pixels", score.iou_pixels},
                      {"offset_m", score.offset_m},
                      {"angle_deg", score.angle_rad * deg},
                      {"rms_m", score.rms_m},
                      {"layers", score.layers},
                      {"holes", score.holes}});
    }
    table.rule();
  }
  std::printf(
      "IoU points: by the surface of a point's voxel; pixels: where its ray meets the polygons. Offset and "
      "angle to the least-squares plane of the label's pixels.\n%s",
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
  app.add_option("--resolutions", options.resolutions, "d, m")->delimiter(',')->capture_default_str();
  app.add_option("--min-points", options.judging.min_points, "of a label that is judged")
      ->capture_default_str();
  app.add_option("--threshold", options.judging.threshold, "Hoover's T")->capture_default_str();
  app.add_flag("--mosd", options.mosd, "the supporting table of mOSD's frames instead; ours alone");
  app.add_option("--only", options.only, "beside octosurf these only: growing, ransac, paper, none")
      ->delimiter(',');
  app.add_option("--set", options.set, "NAME=VALUE for octosurf; may be repeated");
  app.add_option("--json", options.json, "write the numbers there");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main(
      [&] { options.mosd ? octosurf::bench::support_scores(options) : octosurf::bench::planes(options); });
}
