// Real recordings: what inserting them costs beside OctoMap, what it takes of memory, how fast maps are
// loaded; and of the kitchen, which has no truth, what its map looks like, by what must not be in it.

#include "bench/bench.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/ray_tracer.hpp"
#include "support/double_layers.hpp"
#include "surfaces/map_state.hpp"

#include <octosurf/adapters/octomap.hpp>

namespace octosurf::bench {
namespace {

/// Scans that all sides insert.
struct Place {
  std::string path, label;  ///< path: of the names of its sides
  double resolution, max_range;
  std::vector<Scan> scans;

  Parameters parameters() const {
    Parameters parameters = parameters_at(resolution);
    parameters.occupancy.max_range = max_range;
    return parameters;
  }
};

/// Milliseconds of inserting each scan; what `Input` makes of it is prepared beforehand.
template <class Input = const Scan&, class Insert>
Json insert_all(const Place& place, const Insert& insert) {
  std::vector<double> ms;
  for (const Scan& scan : place.scans) {
    const Input input(scan);
    ms.push_back(time_ms([&] { insert(input); }));
  }
  return {{"ms", mean(ms)}, {"p95_ms", percentile(ms, 0.95)}};
}

/// The incumbent: lazy, discretised, and complete after every scan.
Json octomap_insertion(const Place& place) {
  const double heap_before = heap_in_use();
  octomap::OcTree tree(place.resolution);
  Json row = insert_all<OctomapScan>(place, [&](const OctomapScan& scan) {
    tree.insertPointCloud(scan.cloud, scan.origin, place.max_range, true, true);
    tree.updateInnerOccupancy();
  });
  tree.prune();
  row["heap_bytes"] = heap_in_use() - heap_before;
  row["leaves"] = tree.getNumLeafNodes();
  return row;
}

/// insert_point_cloud on the same kind of tree, which is complete after every scan: not lazy.
Json plain_insertion(const Place& place) {
  octomap::OcTree tree(place.resolution);
  return insert_all<OctomapScan>(place, [&](const OctomapScan& scan) {
    insert_point_cloud(tree, scan.cloud, scan.origin, place.max_range, false, true, 1);
  });
}

Json occupancy_insertion(const Place& place) {
  const double heap_before = heap_in_use();
  occupancy::OccupancyMap map(place.parameters().occupancy);
  sensing::Downsampler downsampler(map.grid());
  occupancy::RayTracer trace(map.grid());
  Json row = insert_all(place, [&](const Scan& scan) {
    const sensing::VoxelScan voxels = downsampler(scan, 0, place.max_range, 1);
    map.apply(trace(voxels, downsampler, 1), voxels, nullptr);
  });
  row["heap_bytes"] = heap_in_use() - heap_before;  // with what is kept between scans
  row["tree_bytes"] = map.size().bytes;
  return row;
}

Json mapper_insertion(const Place& place) {
  Mapper mapper(place.parameters(), 1);
  std::vector<ScanReport> reports;
  Json row = insert_all(place, [&](const Scan& scan) { reports.push_back(mapper.insert(scan)); });
  row["stage_ms"] = stages_of(reports);
  return row;
}

/// The stem of the place's files, mapped from nothing, one thread.
std::string saved(const Place& place) {
  static std::map<std::string, std::string> stems;
  std::string& stem = stems[place.label];
  if (!stem.empty()) return stem;
  Mapper mapper(place.parameters(), 1);
  for (const Scan& scan : place.scans) mapper.insert(scan);
  save_map(mapper.map(), stem = scratch(place.label));
  return stem;
}

/// What is loaded is freed after the clock has stopped.
template <class Loaded, class Load>
Json load(const Load& load_into) {
  std::vector<double> ms;
  for (int i = 0; i < 7; ++i) {
    std::optional<Loaded> loaded;
    ms.push_back(time_ms([&] { load_into(loaded); }));
  }
  return {{"ms", mean(ms)}, {"p95_ms", percentile(ms, 0.95)}};
}
Json load_ours(const Place& place) {
  return load<LoadedMap>([stem = saved(place)](auto& loaded) { loaded.emplace(load_map(stem)); });
}
Json read_binary(const Place& place) {
  return load<octomap::OcTree>([file = saved(place) + ".bt"](auto& tree) {
    if (!tree.emplace(0.1).readBinary(file)) throw Error(Error::Kind::data, file, "OctoMap does not read it");
  });
}

/// Sides with the same path before their name do the same work on the same scans.
struct Side {
  std::string name, label;
  std::shared_ptr<const Place> place;
  Json (*run)(const Place&);
};

std::vector<Side> all_sides(const Options& options) {
  std::vector<Side> sides;
  const auto add =
      [&](const Place& of,
          std::initializer_list<std::tuple<const char*, std::string, Json (*)(const Place&)>> all) {
        const auto place = std::make_shared<const Place>(of);
        for (const auto& [name, label, run] : all) {
          const std::string full = place->path + "/" + name;
          if (wanted(options, full)) sides.push_back({full, label, place, run});
        }
      };
  const std::string octomap = "OctoMap's insertion", ours = "occupancy insertion, ";
  for (const bool fine : {false, true}) {
    const std::string d = fine ? "/d:0.01" : "/d:0.02", what = fine ? "kitchen, 1 cm" : "kitchen, 2 cm";
    Place place{"kitchen" + d, what, fine ? 0.01 : 0.02, 4,
                scans_of(kitchen_of(options), (fine ? 15 : 60) / (options.brief ? 3 : 1))};
    add(place, {{"octomap", octomap, octomap_insertion},
                {"occupancy", ours + what, occupancy_insertion},
                {"plain", "`insert_point_cloud` into a plain `octomap::OcTree`, " + what, plain_insertion},
                {"mapper", "whole scan (occupancy and surfaces), " + what, mapper_insertion}});
    place.path = "loading" + d;
    add(place, {{"load_map", "loading the saved " + what, load_ours},
                {"read_binary", "OctoMap's readBinary", read_binary}});
  }
  const std::string hall = "real lidar in a hall, 5 cm";
  add({"lidar/hall", hall, 0.05, 1000, scans_of(data_path("lidar_balm_realworld"), options.brief ? 3 : 12)},
      {{"octomap", octomap, octomap_insertion}, {"occupancy", ours + hall, occupancy_insertion}});
  if (sides.empty())
    throw Error(Error::Kind::usage, "--only", "matches no side", "try kitchen, lidar, loading");
  return sides;
}

}  // namespace

/// Three passes of each side, in random order, so that whatever else the machine does hits all alike.
void speed(const Options& options) {
  const std::vector<Side> sides = all_sides(options);
  std::vector<const Side*> order;
  for (const Side& side : sides) order.insert(order.end(), 3, &side);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(std::random_device{}()));
  for (const Side* side : order)
    write({{"name", side->name}, {"label", side->label}}, side->run(*side->place));
}

void kitchen(const Options& options) {
  constexpr double min_area = 0.05;  // m²: surfaces that are counted
  const double resolution = options.resolutions.front();
  Mapper mapper(parameters_at(resolution, options.set), options.threads);
  octomap::OcTree octomap(resolution);
  std::vector<ScanReport> reports;
  std::vector<double> ms, octomap_ms;
  for_each_kitchen_scan(options, [&](const Scan& scan) {
    ms.push_back(time_ms([&] { reports.push_back(mapper.insert(scan)); }));
    if (options.octomap_every == 0 || (ms.size() - 1) % options.octomap_every != 0) return;
    const OctomapScan input(scan);
    octomap_ms.push_back(time_ms([&] { octomap.insertPointCloud(input.cloud, input.origin); }));
  });
  mapper.drain();
  const std::shared_ptr<const Snapshot> snapshot = mapper.snapshot();
  double area = 0, doubled = 0;
  std::size_t over_min_area = 0;
  for (const SurfacePtr& surface : snapshot->surfaces) {
    area += surface->area_m2;
    over_min_area += surface->area_m2 >= min_area;
  }
  const auto layers = test::double_layers(surfaces::state_of(mapper.map()).surfaces);
  for (const test::DoubleLayer& layer : layers) {
    const Surface& smaller = *snapshot->find(layer.smaller);
    doubled += smaller.area_m2 * static_cast<double>(layer.inliers) / static_cast<double>(smaller.inliers);
  }
  Json row = named(
      "scans resolution surfaces surfaces_over_min_area area_m2 double_layers double_layers_m2 ms stage_ms",
      ms.size(), resolution, snapshot->surfaces.size(), over_min_area, area, layers.size(), doubled, mean(ms),
      stages_of(reports));
  if (!octomap_ms.empty()) row["octomap_ms"] = mean(octomap_ms);
  write(row);
}

}  // namespace octosurf::bench
