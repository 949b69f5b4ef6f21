// What movers leave behind in the octree, beside plain OctoMap of the same scans: the measure of
// DynamicMap_Benchmark (Zhang et al., A dynamic points removal benchmark in point cloud maps, ITSC 2023).

#include "bench/bench.hpp"
#include "sensing/downsample.hpp"

namespace octosurf::bench {
namespace {

/// An upright box that walks to and fro past the sensors' way, as a person does.
struct Mover {
  static constexpr double speed = 1.0, travel_m = 3.0;  // m/s, m
  Eigen::Vector3d start, along;

  Eigen::AlignedBox3d at(double stamp_s) const {
    const double done = std::fmod(speed * stamp_s, 2 * travel_m);
    const Eigen::Vector3d middle = start + (done < travel_m ? done : 2 * travel_m - done) * along;
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
    movers.push_back({scan.T_map_sensor.translation() + 1.5 * ahead - Mover::travel_m / 2 * across, across});
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

}  // namespace

void dynamics(const Options& options) {
  for_each_recording(options, [&](const Recorded& recorded, const Json& recording) {
    const std::vector<Scan>& scans = recorded.scans;
    const std::vector<Mover> movers = movers_of(scans, options.count);
    const double resolution = options.resolutions.front();
    Mapper mapper(parameters_at(resolution, options.set));
    octomap::OcTree tree(resolution);
    std::vector<Mixed> all;
    double now_s = 0;
    for (const Scan& scan : scans) {
      if (!all.empty()) now_s += duration(all.back().scan, scan);
      all.push_back(mixed(scan, now_s, movers));
      mapper.insert(all.back().scan);
      const double range = sensing::default_max_range(scan.sensor);
      const OctomapScan input(all.back().scan);
      tree.insertPointCloud(input.cloud, input.origin, std::isfinite(range) ? range : -1, false, true);
    }
    // Readings by whether a mover's, and whether their voxel is occupied at the end.
    std::array<std::array<std::size_t, 2>, 2> ours{}, plain{};
    for (const Mixed& part : all)
      for (std::size_t i = 0; i < part.moves.size(); ++i) {
        const Eigen::Vector3f& point = part.scan.points[i];
        if (!point.allFinite() || point.norm() > sensing::default_max_range(part.scan.sensor)) continue;
        const Eigen::Vector3d at = part.scan.T_map_sensor * point.cast<double>();
        ++ours[part.moves[i]][mapper.map().at(at).state == OccupancyView::State::occupied];
        const octomap::OcTreeNode* node = tree.search(at.x(), at.y(), at.z());
        ++plain[part.moves[i]][node != nullptr && tree.isNodeOccupied(node)];
      }
    if (ours[1] == std::array<std::size_t, 2>{}) return;
    for (const auto& [name, kept] : {std::pair{"octosurf", &ours}, {"OctoMap", &plain}}) {
      const auto& [still, moving] = *kept;
      write(recording, named("method static kept_static moving kept_moving", name, still[0] + still[1],
                             still[1], moving[0] + moving[1], moving[1]));
    }
  });
}

}  // namespace octosurf::bench
