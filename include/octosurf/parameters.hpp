#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace octosurf {

// One small struct per stage, SI units, angles in radians (degrees only at the command line and in
// files). A std::optional that is empty is derived from the others; an explicit value wins.

/// src/occupancy: the octree and what a scan does to it.
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
  bool preserve_surfaces = true;    ///< a ray erodes a surface's voxel only if it crosses its plane
                                    ///< beyond s; off: the tree equals OctoMap's insertPointCloud
};

/// src/surfaces: what belongs to a surface and what is derived from it.
struct SurfaceParameters {
  std::optional<double> surface_tolerance;  ///< s, m: reach of a plane; empty: derived (Parameters)
  double sensor_noise = 0.005;              ///< m: standard deviation near the sensor
  std::optional<double> range_noise;        ///< 1/m: σ(z) = sensor_noise + range_noise·z²; empty:
                                            ///< estimated from the scans
  std::optional<double> max_hole_size;      ///< h, m: α of the alpha shape, largest gap within a surface;
                                            ///< the paper's detector: reach of expansion; empty: derived
  double min_surface_width = 0.03;          ///< m: narrower clusters stay pending; 0: any; not the paper's
  double mesh_thickness = 0.02;             ///< m: extrusion against the normal
};

/// How surfaces are found and gain points (docs/design.md §4).
enum class DetectorKind {
  likelihood,  ///< one likelihood and one criterion for all stages (docs/detection.md)
  paper        ///< W. Pryor's thresholds and PCL's parts; takes octosurf::pcl (adapters/paper_detector.hpp)
};

/// New surfaces (src/detection) and cylinders (src/cylinders) among pending points.
struct DetectionParameters {
  DetectorKind detector = DetectorKind::likelihood;  ///< stays the map's own
  std::optional<int> min_surface_points;             ///< n; empty: derived
  /// Pending readings in which a scan looks for surfaces at most, or a quarter of those that wait, if that is
  /// more; what is over waits for the next scan or Mapper::drain(). 0: all at once. Not the paper's detector.
  /// 30 µs for each, so 1,000 take as long as a camera takes for a frame; by the quarter none waits for long,
  /// however much comes: after eight scans, a quarter of a second, a tenth of it is left.
  int detection_budget = 1000;
  bool detect_cylinders = true;         ///< look for pillars, rails and rungs among what no plane took
  std::optional<double> search_radius;  ///< r, m: the paper's detector: of outliers and normals; cylinders:
                                        ///< largest neighbourhood; empty: derived
  std::optional<double> normal_radius;  ///< m: cylinders: neighbourhood for normals where points are
                                        ///< dense and exact; empty: derived
  // Of the paper's detector, and of cylinders:
  double smoothness_angle = 0.5235987755982988;  ///< rad: region growing, normal difference (30°)
  double max_curvature = 0.05;                   ///< region growing, surface variation λ₀/Σλ
  int ransac_iterations = 200;                   ///< RANSAC: of a plane, of a cylinder
};

/// src/alignment: a scan's pose against the map, before it is inserted.
struct AlignmentParameters {
  bool enabled = true;  ///< a pose is corrected where scan and map say significantly so; off: taken as given
};

/// Everything that decides what comes out; two runs with equal Parameters and scans give equal bytes.
struct Parameters {
  AlignmentParameters alignment;  ///< a scan's pose
  OccupancyParameters occupancy;  ///< the octree
  SurfaceParameters surfaces;     ///< what belongs to a surface
  DetectionParameters detection;  ///< new surfaces
  /// Unit vector, map frame: against gravity. Nothing is mapped otherwise for it; pictures, slopes and
  /// planners' questions ask it. Empty: found from the surfaces (up.hpp).
  std::optional<Eigen::Vector3d> up = Eigen::Vector3d::UnitZ();

  /// The paper's detector and values (section V): r = 0.15, n = 50, s = sensor_noise + d·√3, no minimum
  /// width, measured noise not used, no cylinders, poses as given.
  static Parameters paper();

  double surface_tolerance() const;  ///< s in force: explicit, else sensor_noise + d/2
  double max_hole_size() const;      ///< h in force: explicit, else 0.08 m, at least 4 d
  double search_radius() const;      ///< r in force: explicit, else 5 d, at least 0.06 m
  double normal_radius() const;      ///< in force: explicit, else 2.5 d
  int min_surface_points() const;    ///< n in force: explicit, else 0.02 m² / d² in [20, 500]

  /// Throws Error(usage) naming field, value and rule.
  void validate() const;
};

/// A parameter as text, for command lines, config files, reports and map files.
/// Names are those of docs/parameters.md; angles are in degrees here.
struct ParameterInfo {
  std::string name;  ///< e.g. "search_radius"
  std::string unit;  ///< "m", "deg", …; empty: a number or a flag
  std::string help;  ///< what it does, one line
};
/// All parameters, in the order of docs/parameters.md.
const std::vector<ParameterInfo>& parameter_infos();

/// Value in force (derived ones resolved; "estimated" for an empty range_noise, "sensor" for an
/// empty max_range). Throws Error(usage) for an unknown name.
std::string get_parameter(const Parameters& parameters, const std::string& name);

/// Sets from text ("auto" empties a derived one). `up` stands for up_x, up_y and up_z together: three
/// numbers, which are brought to length 1, or an axis such as z or -y, or auto. Throws Error(usage) naming
/// name, text and rule.
void set_parameter(Parameters& parameters, const std::string& name, const std::string& text);

/// The exact value as a number in the units of the structs (radians; flags 0 or 1), none where it is
/// to be derived. Throws Error(usage) for an unknown name.
std::optional<double> parameter_value(const Parameters& parameters, const std::string& name);
/// Sets what parameter_value() gave. Throws Error(usage) for an unknown name.
void set_parameter_value(Parameters& parameters, const std::string& name, std::optional<double> value);

}  // namespace octosurf
