// What movers leave behind in the octree, beside plain OctoMap of the same scans: the measure of
// DynamicMap_Benchmark (Zhang et al., A dynamic points removal benchmark in point cloud maps, ITSC 2023).

#include "bench/support.hpp"
#include "sensing/downsample.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <octomap/octomap.h>
#include <string>
#include <vector>

#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> scenes{"office", "room"};
  std::vector<std::string> sensors{"depth", "tilting", "spinning"};
  std::vector<std::string> recordings;  // folders, with poses beside
  std::uint64_t seed = 1;
  double resolution = 0.05;
  std::size_t movers = 3;
  std::vector<std::string> set;
};

/// An upright box that walks to and fro past the sensors' way, as a person does.
struct Mover {
  static constexpr double speed = 1.0, way_m = 3.0;  // m/s, m
  Eigen::Vector3d start, along;

  Eigen::AlignedBox3d at(double stamp_s) const {
    const double done = std::fmod(speed * stamp_s, 2 * way_m);
    const Eigen::Vector3d middle = start + (done < way_m ? done : 2 * way_m - done) * along;
    return {middle - Eigen::Vector3d(0.25, 0.25, 1.2), middle + Eigen::Vector3d(0.25, 0.25, 0.5)};
  }
};

/// Where the segment from `from` along `ray` enters the box, in units of the ray; infinity: nowhere.
double entry(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    const double low = (box.min()[a] - from[a]) / ray[a], high = (box.max()[a] - from[a]) / ray[a];
    enter = std::max(enter, std::min(low, high));
    leave = std::min(leave, std::max(low, high));
  }
  return enter <= leave && enter > 0 ? enter : std::numeric_limits<double>::infinity();
}

/// s from scan to scan, as far as a walking robot goes in it: simulated scans lie farther apart than a
/// sensor's.
double duration(const Scan& from, const Scan& to) {
  constexpr double robot_speed = 0.5, robot_turn = 0.5;  // m/s, rad/s
  const Eigen::Isometry3d motion = from.T_map_sensor.inverse() * to.T_map_sensor;
  return motion.translation().norm() / robot_speed + Eigen::AngleAxisd(motion.linear()).angle() / robot_turn;
}

/// A scan with movers in it, and which of its readings are theirs.
struct Mixed {
  Scan scan;
  std::vector<bool> moves;
};

/// Movers beside the sensors' places at equal shares of the run, each walking across the view.
std::vector<Mover> movers_of(const std::vector<Scan>& scans, std::size_t count) {
  std::vector<Mover> movers;
  for (std::size_t k = 0; k < count; ++k) {
    const Scan& scan = scans[(k + 1) * scans.size() / (count + 1)];
    Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3f& p : scan.points)
      if (p.allFinite()) ahead += scan.T_map_sensor.linear() * p.cast<double>();
    ahead.z() = 0;
    ahead.normalize();
    const Eigen::Vector3d across(-ahead.y(), ahead.x(), 0);
    movers.push_back({scan.T_map_sensor.translation() + 1.5 * ahead - Mover::way_m / 2 * across, across});
  }
  return movers;
}

Mixed mixed(const Scan& scan, double stamp_s, const std::vector<Mover>& movers) {
  Mixed result{scan, std::vector<bool>(scan.points.size())};
  const Eigen::Vector3d from = scan.T_map_sensor.translation();
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    Eigen::Vector3f& point = result.scan.points[i];
    if (!point.allFinite()) continue;
    const Eigen::Vector3d ray = scan.T_map_sensor.linear() * point.cast<double>();
    double nearest = 1;
    for (const Mover& mover : movers) {
      const Eigen::AlignedBox3d box = mover.at(stamp_s);
      if (!box.contains(from)) nearest = std::min(nearest, entry(box, from, ray));
    }
    result.moves[i] = nearest < 1;
    point *= static_cast<float>(nearest);
  }
  return result;
}

/// Readings by whether their voxel is occupied at the end.
struct Score {
  std::size_t kept_static = 0, all_static = 0, kept_moving = 0, all_moving = 0;

  void add(bool moves, bool occupied) {
    ++(moves ? all_moving : all_static);
    if (occupied) ++(moves ? kept_moving : kept_static);
  }
  double static_accuracy() const {
    return 100 * static_cast<double>(kept_static) / static_cast<double>(std::max<std::size_t>(all_static, 1));
  }
  double dynamic_accuracy() const {
    return 100 -
           100 * static_cast<double>(kept_moving) / static_cast<double>(std::max<std::size_t>(all_moving, 1));
  }
  std::vector<std::string> row(const std::string& name) const {
    const double s = static_accuracy(), d = dynamic_accuracy();
    return {name, fixed(s, 2), fixed(d, 2), fixed(std::sqrt(s * d), 2), fixed(2 * s * d / (s + d), 2)};
  }
};

void insert_plain(octomap::OcTree& tree, const Scan& scan, double max_range) {
  octomap::Pointcloud cloud;
  for (const Eigen::Vector3f& p : scan.points) {
    if (!p.allFinite()) continue;
    const Eigen::Vector3f m = (scan.T_map_sensor * p.cast<double>()).cast<float>();
    cloud.push_back(m.x(), m.y(), m.z());
  }
  const Eigen::Vector3f o = scan.T_map_sensor.translation().cast<float>();
  tree.insertPointCloud(cloud, {o.x(), o.y(), o.z()}, max_range, false, true);
}

void compare(const std::string& name, const std::vector<Scan>& scans, const Options& options,
             TextTable& table) {
  const std::vector<Mover> movers = movers_of(scans, options.movers);
  Parameters parameters;
  parameters.occupancy.resolution = options.resolution;
  set_parameters(parameters, options.set);
  Mapper mapper(parameters);
  octomap::OcTree tree(options.resolution);
  std::vector<Mixed> all;
  double farthest = 0;  // m, of alignment's corrections
  double now_s = 0;
  for (const Scan& scan : scans) {
    if (!all.empty()) now_s += duration(all.back().scan, scan);
    all.push_back(mixed(scan, now_s, movers));
    const ScanReport inserted = mapper.insert(all.back().scan);
    farthest = std::max(
        farthest, (inserted.alignment.T_map_sensor.translation() - scan.T_map_sensor.translation()).norm());
    const double range = sensing::default_max_range(scan.sensor);
    insert_plain(tree, all.back().scan, std::isfinite(range) ? range : -1);
  }
  if (farthest > 0)
    std::printf("%s: poses, which are exact, were moved by up to %.1f cm\n", name.c_str(), 100 * farthest);
  Score ours, plain;
  for (const Mixed& part : all)
    for (std::size_t i = 0; i < part.moves.size(); ++i) {
      const Eigen::Vector3f& point = part.scan.points[i];
      if (!point.allFinite() || point.norm() > sensing::default_max_range(part.scan.sensor)) continue;
      const Eigen::Vector3d at = part.scan.T_map_sensor * point.cast<double>();
      ours.add(part.moves[i], mapper.map().at(at).occupancy == Map::Occupancy::occupied);
      const octomap::OcTreeNode* node = tree.search(at.x(), at.y(), at.z());
      plain.add(part.moves[i], node != nullptr && tree.isNodeOccupied(node));
    }
  if (ours.all_moving == 0) return;
  table.rule();
  table.add(ours.row(name + ", octosurf"));
  table.add(plain.row(name + ", OctoMap"));
}

void body(const Options& options) {
  TextTable table({"", "SA %", "DA %", "AA %", "HA %"});
  for (const std::string& scene : options.scenes)
    for (const std::string& sensor : options.sensors) {
      simulation::SimulationOptions simulation;
      simulation.sensor = sensor;
      simulation.seed = options.seed;
      set_scene(scene, simulation);
      compare(scene + " " + sensor, record(simulation).scans, options, table);
    }
  for (const std::string& recording : options.recordings) {
    std::vector<Scan> scans;
    for_each_scan(recording, 3, 200, [&](const Scan& scan, double) { scans.push_back(scan); });
    compare(std::filesystem::path(recording).filename().string(), scans, options, table);
  }
  std::printf(
      "%zu walking boxes, voxels of %g m; SA: readings of what stands whose voxel is occupied at the end; "
      "DA: readings of movers whose voxel is not; AA, HA: their geometric and harmonic mean.\n%s",
      options.movers, options.resolution, table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"what movers leave in the octree, beside plain OctoMap"};
  app.add_option("--scenes", options.scenes)->delimiter(',')->capture_default_str();
  app.add_option("--sensors", options.sensors)->delimiter(',')->capture_default_str();
  app.add_option("--recordings", options.recordings, "folders of real scans, of which each third is taken")
      ->delimiter(',');
  app.add_option("--seed", options.seed)->capture_default_str();
  app.add_option("--resolution", options.resolution, "m")->capture_default_str();
  app.add_option("--movers", options.movers)->capture_default_str();
  app.add_option("--set", options.set, "NAME=VALUE, a parameter");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
