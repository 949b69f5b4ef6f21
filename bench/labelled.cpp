// Planes of labelled clouds: octosurf beside CGAL's and PCL's region growing, CGAL's Efficient RANSAC,
// Open3D's planar patches and the paper's detector from PCL's parts, on the same voxels in one run; and with
// --mosd a real table with its holes.

#include "bench/bench.hpp"
#include "evaluation/labels.hpp"
#include "sensing/downsample.hpp"

namespace octosurf::bench {
namespace {

constexpr double out_of_sight = 100;  // m: labelled clouds are rooms
// From the upper clamp to below one half by misses: ln(0.971 / 0.029) / ln(0.6 / 0.4) = 8.7; 0.3 s of a
// camera.
constexpr int scans_to_forget = 9;
constexpr std::uint32_t support = 1;  // label of mOSD's table

/// A labelled cloud as every method gets it: grouped by voxels of edge d, and the centroid of each.
struct VoxelCloud {
  const evaluation::LabelledCloud& cloud;
  double resolution;                         ///< d, m
  Scan scan{};                               ///< the cloud
  std::vector<Eigen::Vector3d> points{};     ///< the cloud's
  std::vector<Eigen::Vector3f> centroids{};  ///< one per voxel
  std::vector<std::size_t> voxel_of{};       ///< per point, index into centroids
};

/// What one method made of a cloud.
struct Segmentation {
  std::string method, settings;  ///< settings: what was tried for it, e.g. "15°, 5 mm"
  Snapshot snapshot;             ///< planes at least
  std::vector<SurfaceId> found;  ///< per point, the surface of its voxel; 0: none
  double ms = 0;
  evaluation::LabelEvaluation evaluation;

  void judge(const VoxelCloud& cloud) {
    evaluation = evaluation::evaluate_labels(cloud.cloud, cloud.points, found, snapshot);
  }
};

std::vector<std::filesystem::path> inputs_of(const Options& options) {
  if (!options.inputs.empty()) return {options.inputs.begin(), options.inputs.end()};
  if (!options.mosd)
    return {data_path("labelled_synpeb_sample/test_500.pcd"), data_path("labelled_evops_icl")};
  std::vector<std::filesystem::path> files;
  for (const char* setup : {"labelled_mosd/setup_A", "labelled_mosd/setup_B"})
    for (const auto& entry : std::filesystem::directory_iterator(data_path(setup)))
      if (entry.path().extension() == ".pcd") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

VoxelCloud group_by_voxel(const evaluation::LabelledCloud& cloud, double resolution) {
  VoxelCloud result{cloud, resolution};
  result.scan.points = cloud.points;
  result.scan.name = cloud.name;
  const geometry::VoxelGrid grid(resolution);
  sensing::Downsampler downsampler(grid);
  const sensing::VoxelScan voxels = downsampler(result.scan, 0, out_of_sight);
  for (const sensing::EndVoxel& end : voxels.ends) result.centroids.push_back(end.centroid);
  for (const Eigen::Vector3f& point : cloud.points) {
    geometry::VoxelKey key;
    grid.key_of(point, key);
    result.points.push_back(point.cast<double>());
    result.voxel_of.push_back(static_cast<std::size_t>(downsampler.find(key)));
  }
  return result;
}

/// Regions of centroids as surfaces 1, 2, …
Segmentation from_regions(const VoxelCloud& cloud, const CgalPlanes& planes) {
  Segmentation result;
  result.ms = planes.ms;
  result.snapshot.resolution = cloud.resolution;
  std::vector<SurfaceId> of_voxel(cloud.centroids.size(), 0);
  for (const auto& region : planes.regions) {
    const auto id = static_cast<SurfaceId>(result.snapshot.surfaces.size() + 1);
    result.snapshot.surfaces.push_back(surface_of(id, cloud.centroids, region));
    for (const std::size_t i : region) of_voxel[i] = id;
  }
  for (const std::size_t voxel : cloud.voxel_of) result.found.push_back(of_voxel[voxel]);
  result.judge(cloud);
  return result;
}

/// Keeps the one with more correct labels, or as many and less noise.
void keep_best(Segmentation& best, Segmentation result) {
  const auto rank = [](const Segmentation& s) {
    return std::pair(s.evaluation.correct, -static_cast<double>(s.evaluation.noise));
  };
  if (best.found.empty() || rank(result) > rank(best)) best = std::move(result);
}

/// The best of several settings of CGAL's manual and examples, chosen in the method's favour: tolerance 5 mm,
/// 10 mm and octosurf's s; least size octosurf's n.
Segmentation best_of(const VoxelCloud& cloud, const std::string& method, CgalMethod find_planes,
                     const std::vector<double>& angles_rad, const std::vector<double>& gaps) {
  const Parameters parameters = parameters_at(cloud.resolution);
  Segmentation best;
  for (const double tolerance : {0.005, 0.010, parameters.surface_tolerance()})
    for (const double angle_rad : angles_rad)
      for (const double gap : gaps) {
        const CgalSettings settings{tolerance, angle_rad, gap,
                                    static_cast<std::size_t>(parameters.min_surface_points())};
        Segmentation result = from_regions(cloud, find_planes(cloud.centroids, settings));
        result.method = method;
        result.settings = std::to_string(std::lround(angle_rad * deg)) + "°, " +
                          std::to_string(std::lround(tolerance * 1e3)) + " mm, gap " +
                          std::to_string(std::lround(gap * 1e3)) + " mm";
        keep_best(best, std::move(result));
      }
  return best;
}

/// Open3D's planar patches by open3d_planes.py, the best of its settings; none without Open3D.
std::vector<Segmentation> open3d_patches(const VoxelCloud& cloud) {
  const std::string points = scratch("voxels.xyz"), found = scratch("patches.json");
  std::ofstream file(points);
  for (const Eigen::Vector3f& p : cloud.centroids) file << p.transpose() << '\n';
  file.close();
  const std::string least = std::to_string(parameters_at(cloud.resolution).min_surface_points());
  const std::string size = std::to_string(cloud.resolution);
  if (std::system((OCTOSURF_OPEN3D + points + ' ' + size + ' ' + least + " > " + found).c_str()) != 0) {
    std::fputs("skipped: Open3D, of which `./dev test` makes build/release/peers/open3d\n", stderr);
    return {};
  }
  Segmentation best;
  std::ifstream lines(found);
  for (std::string line; std::getline(lines, line);) {
    const Json one = Json::parse(line);
    Segmentation result = from_regions(cloud, {one.at("regions"), one.at("ms")});
    result.method = "Open3D planar patches";
    result.settings = one.at("settings");
    keep_best(best, std::move(result));
  }
  return {best};
}

Parameters in_a_room(Parameters parameters) {
  parameters.occupancy.max_range = out_of_sight;
  return parameters;
}

Segmentation judged(const VoxelCloud& cloud, const Mapper& mapper) {
  Segmentation result;
  result.snapshot = *mapper.snapshot();
  for (const Eigen::Vector3d& point : cloud.points) result.found.push_back(mapper.map().at(point).surface);
  result.judge(cloud);
  return result;
}

Segmentation segment_ours(const VoxelCloud& cloud, const Parameters& parameters, const std::string& name) {
  Mapper mapper(in_a_room(parameters), 1, paper_detector());
  const double ms = time_ms([&] {
    mapper.insert(cloud.scan);
    mapper.drain();
  });
  Segmentation result = judged(cloud, mapper);
  result.method = name;
  result.ms = ms;
  return result;
}

/// Ours first; at d below 1 cm the paper's r of 15 cm holds a thousand points and more, and is left out.
std::vector<Segmentation> segment(const VoxelCloud& cloud, const Options& options) {
  constexpr double finest_for_paper = 0.01;
  const Parameters ours = parameters_at(cloud.resolution, options.set);
  std::vector<Segmentation> results{segment_ours(cloud, ours, "octosurf")};
  if (options.mosd) return results;
  const double h = ours.max_hole_size();
  if (wanted(options, "growing"))
    results.push_back(best_of(cloud, "CGAL region growing", cgal_region_growing, {15 / deg, 25 / deg}, {h}));
  if (wanted(options,
             "pcl"))  // it has no tolerance; a region's angle is between neighbours: 3° is of PCL's manual
    results.push_back(best_of(cloud, "PCL region growing", pcl_region_growing, {3 / deg, 8 / deg}, {h}));
  if (wanted(options, "ransac"))
    results.push_back(best_of(cloud, "CGAL Efficient RANSAC", cgal_efficient_ransac,
                              {std::acos(0.87), std::acos(0.95)}, {2.5 * cloud.resolution, h}));
  if (wanted(options, "open3d"))
    for (Segmentation& one : open3d_patches(cloud)) results.push_back(std::move(one));
  for (const auto& [radius, name] : {std::pair{0.15, "0.15"}, {0.06, "0.06"}})
    if (wanted(options, "paper") && (radius < 0.1 || cloud.resolution >= finest_for_paper))
      results.push_back(segment_ours(cloud, paper_parameters(cloud.resolution, radius),
                                     std::string("`detector = paper`, r = ") + name));
  return results;
}

/// Share of the support's readings before which the map has a surface, by more than `clear` along the ray:
/// what was there and was taken away.
double behind_what_went(const VoxelCloud& cloud, const Segmentation& segmentation) {
  constexpr double clear = 0.03;  // m: no noise of that camera, at a metre
  const std::vector<Face> surfaces = faces_of(segmentation.snapshot);
  double behind = 0, all = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.cloud.labels[i] != support) continue;
    const Eigen::Vector3d& p = cloud.points[i];
    ++all;
    behind += std::ranges::any_of(surfaces, [&](const Face& one) {
      const double stretch = one.plane.offset / one.normal().dot(p);
      return stretch > 0 && stretch < 1 - clear / p.norm() && one.holds(stretch * p);
    });
  }
  return behind / all;
}

/// How well one surface is the support (a table, label 1) of a labelled cloud seen from the origin.
/// `iou_points`: of label 1 and the points whose voxel is the surface's. `iou_pixels`: the same as one sees
/// it, label 1 and the pixels whose ray meets the surface's polygons; what lies on the table hides what is
/// behind it, so polygons that run on under or behind a thing count against the surface. Offset and angle are
/// to the least-squares plane of the label.
Json support_score(const VoxelCloud& cloud, const Segmentation& segmentation) {
  const auto& labels = segmentation.evaluation.label_scores;
  const auto label = std::ranges::find(labels, support, &evaluation::LabelScore::label);
  if (label == labels.end())
    throw Error(Error::Kind::data, "labels", "no point belongs to the support", "label 1 is expected");
  const Surface* surface = segmentation.snapshot.find(label->surface);
  if (surface == nullptr) return Json::object();
  const evaluation::PlanarRegion region(surface->polygons);
  const Eigen::Isometry3d to_surface = surface->T_map_surface.inverse();
  double both = 0, either = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.cloud.labels[i] == 0) continue;
    const double stretch = surface->plane.offset / surface->plane.normal.dot(cloud.points[i]);
    const bool meets = std::isfinite(stretch) && stretch > 0 &&
                       region.contains((to_surface * (stretch * cloud.points[i])).head<2>());
    both += meets && cloud.cloud.labels[i] == support;
    either += meets || cloud.cloud.labels[i] == support;
  }
  if (label->surface == 0) return Json::object();
  return named("iou_points iou_pixels offset_m angle_deg", label->iou, both / either, label->offset_m,
               label->normal_rad * deg);
}

}  // namespace

void labelled(const Options& options) {
  std::optional<Mapper> growing;  // of a folder's frames one after the other, in which things were moved
  std::filesystem::path folder;
  for (const std::filesystem::path& input : inputs_of(options)) {
    evaluation::LabelledCloud cloud = evaluation::load_labelled_cloud(input);
    // Named within the folder of data, if it lies there: rows look the same wherever that folder is.
    const std::filesystem::path within = std::filesystem::relative(input, OCTOSURF_DATA_DIR);
    if (!within.empty() && *within.begin() != "..") cloud.name = within.string();
    for (const double resolution : options.resolutions) {
      const VoxelCloud voxels = group_by_voxel(cloud, resolution);
      for (const Segmentation& segmentation : segment(voxels, options)) {
        Json row = options.mosd ? support_score(voxels, segmentation)
                                : Json::parse(to_json(segmentation.evaluation));
        row.erase("label_scores");
        row["settings"] = segmentation.settings;
        if (options.mosd) {
          if (std::exchange(folder, input.parent_path()) != input.parent_path()) growing.reset();
          if (!growing) growing.emplace(in_a_room(parameters_at(resolution, options.set)));
          for (int k = 0; k < scans_to_forget; ++k) growing->insert(voxels.scan);
          row["behind_what_went"] = behind_what_went(voxels, judged(voxels, *growing));
        }
        write(
            named("cloud resolution method ms", cloud.name, resolution, segmentation.method, segmentation.ms),
            row);
      }
    }
  }
}

}  // namespace octosurf::bench
