#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::reference {

/// The paper's steps (sections III and IV), in order.
enum class PaperStage {
  downsample,
  change_detection,
  add_inliers,
  expand,
  accumulate,
  normals,
  regions,
  planes,
  derive
};
inline constexpr std::array<std::string_view, 9> paper_stage_names{
    "downsample", "change_detection", "add_inliers", "expand", "accumulate",
    "normals",    "regions",          "planes",      "derive"};

struct PaperReport {
  std::size_t points_raw = 0;   ///< handed in
  std::size_t voxels = 0;       ///< after range limits and downsampling
  std::size_t points_new = 0;   ///< after change detection
  std::size_t outliers = 0;     ///< removed for good by the radius filter
  std::size_t categorized = 0;  ///< of points_new, in a surface when insert returned
  std::array<double, paper_stage_names.size()> stage_ms{};
  double total_ms = 0;
};

/// W. Pryor's pipeline, step by step, from stock PCL parts: the baseline of the benchmarks and the
/// oracle of tests. Slow where the paper is slow (all pending points pass through moving least
/// squares with every scan) and wrong where it is wrong (planes are never refitted, nothing is ever
/// taken back, surfaces never merge).
///
/// Where the paper's text leaves a choice, or PCL's part does not do what the text says:
/// - Change detection remembers every voxel ever seen; PCL's OctreePointCloudChangeDetector compares
///   with the previous cloud only, and "once a point enters the system it is never lost".
/// - Point in polygon is odd-even over all rings (IV-A); PCL's CropHull counts holes as inside.
/// - Region growing has PCL's 30 nearest neighbours; PCL's part knows no radius.
/// - Normals come from MLS of degree 1 and weight r²; the points stay where they were measured.
/// - What the radius filter removes is gone, as III-C1 says of it; it is counted.
///
/// Of Parameters it uses resolution, max_range, min_range, surface_tolerance, max_hole_size,
/// search_radius, min_surface_points, smoothness_angle, max_curvature and ransac_iterations.
/// Deterministic, one thread.
class PaperPipeline {
 public:
  explicit PaperPipeline(const Parameters& parameters);  ///< throws Error(usage) if they are invalid
  PaperPipeline(PaperPipeline&&) noexcept;
  PaperPipeline& operator=(PaperPipeline&&) noexcept;
  ~PaperPipeline();

  /// Throws Error(data) if the pose is not rigid or the scan spans more voxels than PCL can number.
  PaperReport insert(const Scan& scan);

  /// The same without downsampling: `points` in the map frame, `views` from each toward its sensor
  /// (any length). Throws Error(usage) if the counts differ.
  PaperReport insert_points(const std::vector<Eigen::Vector3f>& points,
                            const std::vector<Eigen::Vector3f>& views);

  /// Only downsampling and change detection; what is new waits in the accumulator. Many scans
  /// collected and then detect_collected() once is the pipeline offline, on the whole voxel cloud.
  void collect(const Scan& scan);
  PaperReport detect_collected();

  Snapshot snapshot() const;
  std::size_t pending() const;   ///< points in the accumulator
  std::size_t outliers() const;  ///< points lost to the radius filter so far

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The pipeline run once over a whole cloud, e.g. the points of a finished map.
Snapshot paper_pipeline_offline(const std::vector<Eigen::Vector3f>& points,
                                const std::vector<Eigen::Vector3f>& views, const Parameters& parameters);

/// The paper's values (section V) and, with them, the radius at which it does best on small things.
Parameters paper_parameters(double resolution = 0.02);
Parameters paper_parameters_small_radius(double resolution = 0.02);

}  // namespace octosurf::reference
