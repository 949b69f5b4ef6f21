#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace octosurf {

// One small struct per stage, SI units. An empty std::optional is derived from the other parameters; an
// explicit value overrides it.

/// src/core/occupancy: the octree and its update by a scan.
struct OccupancyParameters {
  double resolution = 0.02;         ///< d, m: voxel edge; also of downsampling and change detection
  std::optional<double> max_range;  ///< m: beyond it points only free space; empty: 4 for depth
                                    ///< cameras, unlimited for lidar
  double min_range = 0.0;           ///< m: nearer points are dropped
  double hit = 0.7;                 ///< P(occupied | endpoint)
  double miss = 0.4;                ///< P(occupied | ray passed through)
  double clamp_min = 0.1192;        ///< probability, lower clamp
  double clamp_max = 0.971;         ///< probability, upper clamp
  double occupied = 0.5;            ///< probability from which a voxel counts as occupied
  bool preserve_surfaces = true;    ///< a ray erodes a surface's voxel only if it crosses its plane beyond s;
                                    ///< off: the tree equals OctoMap's insertPointCloud
};

/// src/core/surfaces: membership in a surface and derived geometry.
struct SurfaceParameters {
  std::optional<double> surface_tolerance;  ///< s, m: reach of a plane; empty: derived (Parameters)
  double sensor_noise = 0.005;              ///< m: standard deviation near the sensor
  std::optional<double> range_noise;        ///< 1/m: σ(z) = sensor_noise + range_noise·z²; empty:
                                            ///< estimated from the scans
  std::optional<double> max_hole_size;      ///< h, m: α of the alpha shape, largest gap within a surface,
                                            ///< reach of expansion along the plane; empty: derived
  double min_surface_width = 0.03;          ///< m: narrower clusters stay pending; 0: any; not the paper's
};

/// Method of finding and growing surfaces (docs/design.md §4).
enum class DetectorKind {
  likelihood,  ///< one likelihood and one criterion for all stages (docs/detection.md)
  paper        ///< W. Pryor's thresholds and PCL's parts; needs octosurf::pcl (adapters/paper_detector.hpp)
};

/// New surfaces (src/core/detection) and cylinders (src/core/cylinders) among pending points.
struct DetectionParameters {
  DetectorKind detector = DetectorKind::likelihood;  ///< fixed for a map
  std::optional<int> min_surface_points;             ///< n; empty: derived
  /// Readings segmented per scan (one in 2 cm at finer resolutions): at most this many or a quarter of the
  /// backlog, if that is more. Near known surfaces a block has its turn every third scan. The rest waits for
  /// the next scans or Mapper::drain(). 0: no limit. Not for the paper's detector. In real time (`octosurf
  /// map --realtime`, the ROS node) 1,000, as long as a camera frame at 30 µs each; the quarter bounds a
  /// large backlog's delay: after eight scans a tenth of it is left.
  int detection_budget = 0;
  bool detect_cylinders = true;         ///< find pillars, rails and rungs among pending points
  std::optional<double> search_radius;  ///< r, m: of the paper's detector, for outliers and normals; empty:
                                        ///< derived
};

/// All settings that affect the result; equal Parameters and scans give equal bytes.
struct Parameters {
  bool align = true;              ///< correct significant pose errors; off: poses are used as given
  OccupancyParameters occupancy;  ///< the octree
  SurfaceParameters surfaces;     ///< what belongs to a surface
  DetectionParameters detection;  ///< new surfaces
  /// Unit vector, map frame: against gravity. Used by pictures, slopes and planners' queries, not by mapping.
  /// Empty: estimated from the surfaces (up.hpp).
  std::optional<Eigen::Vector3d> up = Eigen::Vector3d::UnitZ();

  /// The paper's detector and values (section V) for this d and noise: s = sensor_noise + d·√3, r = 0.15 m in
  /// [5 d, 64 d], n = 50, no minimum width, measured noise not used, no cylinders, poses as given.
  static Parameters paper(double resolution = 0.02, double sensor_noise = 0.005);

  double surface_tolerance() const;  ///< effective s: explicit, else sensor_noise + d/2
  double max_hole_size() const;      ///< effective h: explicit, else 0.08 m, at least 4 d
  double search_radius() const;      ///< effective r: explicit, else 5 d, at least 0.06 m
  int min_surface_points() const;    ///< effective n: explicit, else 0.02 m² / d² in [20, 500]

  /// Throws Error(usage) naming field, value and rule.
  void validate() const;
};

/// A parameter as text, for command lines, config files, reports and map files.
/// Names are those of docs/parameters.md.
struct ParameterInfo {
  std::string name;  ///< e.g. "search_radius"
  std::string unit;  ///< "m", …; empty: a number or a flag
  std::string help;  ///< description, one line
};
/// All parameters, in the order of docs/parameters.md.
const std::vector<ParameterInfo>& parameter_infos();

/// Effective value (derived ones resolved; "estimated" for an empty range_noise, "sensor" for an empty
/// max_range). Throws Error(usage) for an unknown name.
std::string get_parameter(const Parameters& parameters, const std::string& name);

/// Sets a parameter from text ("auto" empties a derived one). `up` sets up_x, up_y and up_z together: three
/// numbers, normalised to length 1, an axis such as z or -y, or auto. Throws Error(usage) naming name, text
/// and rule.
void set_parameter(Parameters& parameters, const std::string& name, const std::string& text);

/// The exact value as a number in the units of the structs (flags 0 or 1), empty if derived. Throws
/// Error(usage) for an unknown name.
std::optional<double> parameter_value(const Parameters& parameters, const std::string& name);
/// Sets a value returned by parameter_value(). Throws Error(usage) for an unknown name.
void set_parameter_value(Parameters& parameters, const std::string& name, std::optional<double> value);

}  // namespace octosurf
