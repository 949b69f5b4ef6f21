#pragma once

#include "evaluation/planar_region.hpp"
#include "evaluation/truth.hpp"
#include "simulation/recording.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <octomap/OcTree.h>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>
#include <octosurf/up.hpp>

/// One program of benchmarks: each measures methods on recordings and writes what it counts, a JSON object a
/// line. bench.py adds the lines up, and shows them.
namespace octosurf::bench {

using Json = nlohmann::ordered_json;

inline constexpr double deg = 180 / std::numbers::pi;
inline constexpr double max_slope = std::numbers::pi / 6;  ///< rad, of what a foot is put on

/// What bench.py hands over as JSON; it has the defaults of each benchmark.
struct Options {
  std::vector<std::string> scenes{"room", "office", "stairs", "stones"}, sensors{"depth"};
  std::vector<std::uint64_t> seeds{1};
  std::vector<double> resolutions{0.02};  ///< d, m
  std::vector<std::string> only;          ///< see wanted()
  std::vector<std::string> set;           ///< NAME=VALUE, parameters of ours
  std::vector<std::string> inputs;        ///< real recordings, labelled clouds
  std::size_t count = 0;                  ///< of footholds
  std::size_t frames = 0;                 ///< scans at most; 0: all
  std::size_t every = 1, octomap_every = 0;
  double noise_scale = 1, drift_m = 0, drift_deg = 0;  ///< drift: a lap
  int laps = 1, threads = 1;
  bool mosd = false, brief = false;
};

using Benchmark = void(const Options& options);
Benchmark accuracy, departures, footholds, ground, kitchen, labelled, life, repeatability, speed, steadiness,
    table1;

/// Writes a line, at once: both objects as one.
void write(Json row, const Json& more = Json::object());

/// A row of these names, apart by blanks, and their values.
template <class... Value>
Json named(const char* names, const Value&... values) {
  std::istringstream words(names);
  std::string word;
  Json row;
  ((words >> word, row[word] = values), ...);
  return row;
}

/// Counts by name, of which none is missing.
struct Counts {
  Json row;

  explicit Counts(std::initializer_list<const char*> names) {
    for (const char* name : names) row[name] = std::uint64_t{0};
  }
  std::uint64_t& operator[](const char* name) { return row.at(name).get_ref<std::uint64_t&>(); }
};

/// A simulated recording, all in memory.
struct Recorded {
  std::shared_ptr<const simulation::Recording> simulated;
  std::vector<Scan> scans;
  std::vector<std::vector<std::uint16_t>> labels;  ///< of each scan's points: faces
  evaluation::Truth truth;
};

/// Visits each recording: sensor, scene (or mesh), seed; `row` has their names.
void for_each_recording(const Options& options,
                        const std::function<void(const Recorded&, const Json& row)>& visit);

/// Default parameters at this resolution, and what --set says.
Parameters parameters_at(double resolution, const std::vector<std::string>& set = {});

/// The paper's, but for r.
Parameters paper_parameters(double resolution, double search_radius);

/// Whether --only lets a name pass: its beginning, as a regular expression.
bool wanted(const Options& options, const std::string& name);

/// A folder or file of ../shared/data; throws Error(data) if it is missing.
std::filesystem::path data_path(const std::string& name);
/// The kitchen, or what --inputs names in its place.
std::filesystem::path kitchen_of(const Options& options);
/// The first scans of a recording, or all.
std::vector<Scan> scans_of(const std::filesystem::path& recording, std::size_t limit = 0);

using VisitScan = std::function<void(const Scan&)>;
/// The kitchen's, by --every and --frames.
void for_each_kitchen_scan(const Options& options, const VisitScan& visit);
/// `run(row, scans)` of the kitchen, and of each simulated recording, of these every `every`-th scan.
void for_each_run(
    const Options& options, std::size_t every,
    const std::function<void(Json row, const std::function<void(const VisitScan&)>& scans)>& run);

/// OctoMap's input in its own form, in the map's frame.
struct OctomapScan {
  octomap::Pointcloud cloud;
  octomap::point3d origin;
  explicit OctomapScan(const Scan& scan);
};

/// A surface, or a true face that stands at the end, ready for queries.
struct Face {
  Plane plane;
  Eigen::Isometry3d T_map_face;
  evaluation::PlanarRegion region;
  const Surface* surface = nullptr;
  const evaluation::TrueFace* truth = nullptr;
  Eigen::Isometry3d T_face_map = T_map_face.inverse();

  const Eigen::Vector3d& normal() const { return plane.normal; }
  double height(const Eigen::Vector3d& p) const { return plane.signed_distance(p); }
  Eigen::Vector2d foot(const Eigen::Vector3d& p) const { return (T_face_map * p).head<2>(); }
  bool holds(const Eigen::Vector3d& p) const { return region.contains(foot(p)); }
  /// Calls `visit(p)` for the points of a grid, as PlanarRegion::for_each_cell().
  template <class Visit>
  void for_each_point(double step, const Visit& visit) const {
    region.for_each_cell(step, [&](const Eigen::Vector2d& uv) {
      visit(Eigen::Vector3d(T_map_face * Eigen::Vector3d(uv.x(), uv.y(), 0)));
    });
  }
};
// What they are of must outlive them.
std::vector<Face> faces_of(const Snapshot& snapshot);
std::vector<Face> standing_faces(const evaluation::Truth& truth);
/// How far a point of something with this normal lies off the outlines of all faces that slope alike, by
/// max_slope, and whose planes are within `tolerance`; `at_most` if that far or farther.
double off_outlines(const std::vector<Face>& faces, const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
                    double tolerance, double at_most);

/// Points every centimetre all over a contact with `margin` around it, its outline included, about its
/// reference point.
std::vector<Eigen::Vector2d> points_of(const ContactShape& shape, double margin);
/// The outline of a contact; around a disc.
Ring2 ring_of(const ContactShape& shape);

/// The smallest value that at least `share` of the values do not exceed; 0 if there are none.
double percentile(std::vector<double> values, double share);
/// Median and 99th percentile: PREFIXp50_UNIT, PREFIXp99_UNIT.
Json quantiles(const std::string& prefix, const std::string& unit, const std::vector<double>& values);
double mean(const std::vector<double>& values);

/// Wall-clock milliseconds of one call.
double time_ms(const std::function<void()>& work);

/// A statistic of each stage's ms.
Json stages_of(const std::vector<ScanReport>& reports,
               double (*statistic)(const std::vector<double>&) = mean);

/// Bytes of heap in use: what malloc rounds up and its chunk heads are counted, what is freed is not.
double heap_in_use();

/// A file of its own under the system's temporary folder; gone with the program.
std::string scratch(const std::string& name);

// CGAL's two plane finders, in Eigen's types.

struct CgalSettings {
  double tolerance;        ///< m: a point's distance to its plane ("epsilon")
  double angle_rad;        ///< between a point's normal and its plane's
  double gap;              ///< m: Efficient RANSAC's cluster_epsilon; growing has none
  std::size_t min_points;  ///< of a plane
};
struct CgalPlanes {
  std::vector<std::vector<std::size_t>> regions;  ///< indices of the points
  double ms = 0;                                  ///< of normals and planes
};
using CgalMethod = CgalPlanes (*)(const std::vector<Eigen::Vector3f>&, const CgalSettings&);
/// Normals from 24 neighbours (PCA), as both methods need them; growing over 12 neighbours as in CGAL's
/// manual. Fewer than 30 points give nothing.
CgalPlanes cgal_region_growing(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings);
CgalPlanes cgal_efficient_ransac(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings);
/// PCL's region growing by normals and curvature, in the same form; it has no tolerance.
CgalPlanes pcl_region_growing(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings);

/// Surfaces, and their time, of one centroid per voxel of all scans, as octosurf starts from; s, h, n and the
/// angle are octosurf's. Least-squares planes toward where they were seen from; outlines: the paper's alpha
/// shape.
std::pair<Snapshot, double> cgal_surfaces(CgalMethod method, const std::vector<Scan>& scans,
                                          const Parameters& parameters);

/// A surface without outline: the least-squares plane of points[i], i in `indices`, of which there must be
/// three or more, its normal of either sign, and their centroid.
std::shared_ptr<Surface> surface_of(SurfaceId id, const std::vector<Eigen::Vector3f>& points,
                                    const std::vector<std::size_t>& indices);

}  // namespace octosurf::bench
