// Inserting scans: occupancy, plain trees, whole scans; what they take of memory; loading what was mapped.

#include "bench/speed/speed.hpp"
#include "bench/support.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/ray_tracer.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <octomap/OcTree.h>
#include <optional>
#include <sstream>

#include <octosurf/adapters/octomap.hpp>
#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

/// Scans that all sides insert.
struct Place {
  std::string path;  ///< of the names of its benchmarks
  std::string label;
  double resolution;
  std::size_t count;
  const Scans& (*read)(std::size_t count);
  double max_range = std::numeric_limits<double>::infinity();

  const Scans& scans() const { return read(count); }
  double octomap_range() const {
    return std::isinf(max_range) ? -1 : max_range;
  }  ///< its way to say unlimited
  Parameters parameters() const { return parameters_at(resolution, max_range); }
};

const Scans& read_kitchen(std::size_t count) { return kitchen_scans(count); }

Place kitchen_place(const std::string& path, double resolution, std::size_t count) {
  return {path, "kitchen, " + centimetres(resolution), resolution, count, read_kitchen, camera_range};
}

/// OctoMap's input in its own form, in the map's frame.
struct OctomapScan {
  octomap::Pointcloud cloud;
  octomap::point3d origin;

  explicit OctomapScan(const Scan& scan) : origin(point(scan.T_map_sensor.translation())) {
    cloud.reserve(scan.points.size());
    for (const Eigen::Vector3f& p : scan.points)
      if (p.allFinite()) cloud.push_back(point(scan.T_map_sensor * p.cast<double>()));
  }
  static octomap::point3d point(const Eigen::Vector3d& p) {
    const Eigen::Vector3f single = p.cast<float>();
    return {single.x(), single.y(), single.z()};
  }
};

/// Counters `voxels`, how many are known, and `digest` of the log-odds of each: equal for equal maps.
template <class LogOdds>
void count_voxels(benchmark::State& state, const octomap::OcTree& tree, const LogOdds& log_odds) {
  const geometry::PackedKeyHash mix;
  std::uint64_t digest = 0, voxels = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const octomap::OcTreeKey first = leaf.getIndexKey();
    const unsigned edge = 1u << (tree.getTreeDepth() - leaf.getDepth());
    for (unsigned i = 0; i < edge * edge * edge; ++i) {
      const geometry::VoxelKey voxel{static_cast<std::uint16_t>(first[0] + i % edge),
                                     static_cast<std::uint16_t>(first[1] + i / edge % edge),
                                     static_cast<std::uint16_t>(first[2] + i / edge / edge)};
      const float value = log_odds(voxel, *leaf) + 0.0f;  // -0 is 0
      digest += mix(mix(voxel.packed()) ^ std::bit_cast<std::uint32_t>(value));
      ++voxels;
    }
  }
  state.counters["voxels"] = static_cast<double>(voxels);
  state.counters["digest"] = as_counter(digest);
}

float own_value(geometry::VoxelKey /*voxel*/, const octomap::OcTreeNode& leaf) { return leaf.getLogOdds(); }

/// The incumbent: lazy, discretised, and complete after every scan.
void octomap_insertion(benchmark::State& state, const Place& place) {
  const Scans& scans = place.scans();
  const double heap_before = heap_in_use();
  octomap::OcTree tree(place.resolution);
  std::optional<OctomapScan> input;
  for_each(
      state, scans, [&](const Scan& scan) { input.emplace(scan); },
      [&](const Scan&) {
        tree.insertPointCloud(input->cloud, input->origin, place.octomap_range(), true, true);
        tree.updateInnerOccupancy();
      });
  input.reset();
  tree.prune();
  state.counters["heap_bytes"] = heap_in_use() - heap_before;
  state.counters["leaves"] = static_cast<double>(tree.getNumLeafNodes());
  count_voxels(state, tree, own_value);
}

/// insert_point_cloud on the same kind of tree, which is complete after every scan: not lazy.
void plain_insertion(benchmark::State& state, const Place& place) {
  octomap::OcTree tree(place.resolution);
  std::optional<OctomapScan> input;
  for_each(
      state, place.scans(), [&](const Scan& scan) { input.emplace(scan); },
      [&](const Scan&) {
        insert_point_cloud(tree, input->cloud, input->origin, place.octomap_range(), false, true, 1);
      });
  count_voxels(state, tree, own_value);
}

void occupancy_insertion(benchmark::State& state, const Place& place) {
  const Scans& scans = place.scans();
  const double heap_before = heap_in_use();
  occupancy::OccupancyMap map(place.parameters().occupancy);
  sensing::Downsampler downsampler(map.grid());
  occupancy::RayTracer trace(map.grid());
  for_each(
      state, scans, [](const Scan&) {},
      [&](const Scan& scan) {
        const sensing::VoxelScan voxels = downsampler(scan, 0, place.max_range, 1);
        map.apply(trace(voxels, downsampler, 1), voxels, nullptr);
      });
  state.counters["heap_bytes"] = heap_in_use() - heap_before;  // with what is kept between scans
  state.counters["tree_bytes"] = static_cast<double>(map.size().bytes);
  std::stringstream written;
  map.write_bt(written);
  octomap::OcTree known(place.resolution);
  if (!known.readBinary(written)) throw Error(Error::Kind::data, "write_bt", "OctoMap does not read it");
  count_voxels(state, known, [&](geometry::VoxelKey voxel, const octomap::OcTreeNode&) {
    const occupancy::OccupancyMap::Lookup found = map.at(voxel);
    return found.state == occupancy::OccupancyMap::State::unknown ? std::numeric_limits<float>::infinity()
                                                                  : found.log_odds;
  });
}

void mapper_insertion(benchmark::State& state, const Place& place) {
  Mapper mapper(place.parameters(), 1);
  std::vector<double> scan_ms;
  std::array<double, stage_names.size()> stage_ms{};
  for_each(
      state, place.scans(), [](const Scan&) {},
      [&](const Scan& scan) {
        const ScanReport report = mapper.insert(scan);
        scan_ms.push_back(report.total_ms);
        for (std::size_t stage = 0; stage < stage_ms.size(); ++stage)
          stage_ms[stage] += report.stage_ms[stage];
      });
  for (std::size_t stage = 0; stage < stage_ms.size(); ++stage)
    state.counters[std::string(stage_names[stage]) + "_ms"] =
        benchmark::Counter(stage_ms[stage], benchmark::Counter::kAvgIterations);
  state.counters["p95_ms"] = percentile(scan_ms, 0.95);
  state.counters["surfaces"] = static_cast<double>(mapper.snapshot()->surfaces.size());
}

using Insertion = void (*)(benchmark::State&, const Place&);

void add_side(const Place& place, const char* side, const std::string& label, const Insertion& insertion) {
  add(place.path + "/" + side, label, place.count, [place, insertion](benchmark::State& state) {
    insertion(state, place);
  })->UseRealTime();
}

constexpr const char* incumbent = "OctoMap's insertion";

void add_occupancy(const Place& place) {
  add_side(place, "octomap", incumbent, octomap_insertion);
  add_side(place, "occupancy", "occupancy insertion, " + place.label, occupancy_insertion);
}

/// The kitchen mapped from nothing, one thread, and saved.
std::string saved_kitchen(const Place& place) {
  const std::filesystem::path stem = scratch_folder() / key('d', place.resolution);
  Mapper mapper(place.parameters(), 1);
  for (const Scan& scan : place.scans()) mapper.insert(scan);
  save_map(mapper.map(), stem);
  return stem.string();
}

void add_loading(const Place& place) {
  const std::string path = "loading/" + key('d', place.resolution), what = "loading the saved " + place.label;
  const auto saved = [place] {
    static std::map<double, std::string> stems;
    std::string& stem = stems[place.resolution];
    if (stem.empty()) stem = saved_kitchen(place);
    return stem;
  };
  constexpr std::size_t times = 7;
  add(path + "/load_map", what, times, [saved](benchmark::State& state) {
    const std::string stem = saved();
    std::optional<LoadedMap> loaded;
    for ([[maybe_unused]] auto _ : state) {
      state.PauseTiming();
      loaded.reset();
      state.ResumeTiming();
      loaded.emplace(load_map(stem));
    }
  })->UseRealTime();
  add(path + "/read_binary", "OctoMap's readBinary", times, [saved](benchmark::State& state) {
    const std::string file = saved() + ".bt";
    std::optional<octomap::OcTree> tree;
    for ([[maybe_unused]] auto _ : state) {
      state.PauseTiming();
      tree.emplace(0.1);
      state.ResumeTiming();
      if (!tree->readBinary(file)) throw Error(Error::Kind::data, file, "OctoMap does not read it");
    }
  })->UseRealTime();
  add(path + "/anew", "mapping it anew", 1, [place](benchmark::State& state) {
    place.scans();
    for ([[maybe_unused]] auto _ : state) saved_kitchen(place);
  })->UseRealTime();
}

}  // namespace

void add_insertion(bool brief) {
  for (const Place& place : {kitchen_place("kitchen/d:0.02", 0.02, brief ? 20 : 60),
                             kitchen_place("kitchen/d:0.01", 0.01, brief ? 4 : 15)}) {
    add_occupancy(place);
    add_side(place, "plain", "`insert_point_cloud` into a plain `octomap::OcTree`, " + place.label,
             plain_insertion);
    add_side(place, "mapper", "whole scan (occupancy and surfaces), " + place.label, mapper_insertion);
    add_loading(place);
  }
  add_occupancy({"lidar/hall", "real lidar in a hall, 5 cm", 0.05, brief ? 3u : 12u, hall_scans});
  add_occupancy(
      {"lidar/office", "simulated spinning lidar, office, 2 cm", 0.02, brief ? 3u : 10u, office_scans});
}

}  // namespace octosurf::bench
