// Rows about inserting scans: occupancy, whole scans, memory, and loading what was mapped.

#include "bench/speed/heats.hpp"
#include "bench/support.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

constexpr const char* octomap_insertion = "OctoMap's insertion";

double number(const Json& told, const char* name) { return told.at(name).get<double>(); }

std::string resolution_name(double resolution) {
  char text[32];
  std::snprintf(text, sizeof text, "d:%g", resolution);
  return text;
}

/// The kitchen at `resolution`, with OctoMap in it; fewer frames at 1 cm in the short form.
Heat& kitchen_heat(const SpeedOptions& options, double resolution) {
  const ScanSet scans = kitchen_scans(options, options.count(resolution < 0.015 ? 10 : 60, 0));
  Heat& heat = Heat::of("kitchen " + resolution_name(resolution), scans);
  heat.enter("octomap", "octomap", settings_for(scans, resolution));
  return heat;
}

/// `kind`: occupancy or plain.
std::string enter_ours(Heat& heat, const std::string& kind, const ScanSet& scans, double resolution,
                       int threads) {
  const std::string name = kind + " " + std::to_string(threads);
  Json settings = settings_for(scans, resolution);
  settings["threads"] = threads;
  heat.enter(name, kind, settings);
  return name;
}

std::string with_threads(int threads) {
  return threads == 1 ? ", one thread" : ", " + std::to_string(threads) + " threads";
}

Numbers occupancy_numbers(Heat& heat, const std::string& ours) {
  Numbers numbers = compare(heat.turns(ours), heat.turns("octomap"));
  numbers["voxels"] = number(heat.told(ours), "voxels");
  numbers["voxels_that_differ"] = number(heat.told(ours), "differ");
  return numbers;
}

std::string enter_mapper(Heat& heat, const ScanSet& scans, double resolution) {
  heat.enter("mapper", "mapper", settings_for(scans, resolution));
  return "mapper";
}

Numbers mapper_numbers(Heat& heat, const std::string& ours, const std::string& theirs) {
  Numbers numbers = compare(heat.turns(ours), heat.turns(theirs));
  for (std::size_t stage = 0; stage < stage_names.size(); ++stage) {
    std::vector<double> ms;
    for (const Turn& turn : heat.turns(ours)) ms.push_back(turn.stage_ms.at(stage));
    numbers[std::string(stage_names[stage]) + "_ms"] = median(ms);
  }
  numbers["surfaces"] = number(heat.told(ours), "surfaces");
  return numbers;
}

}  // namespace

namespace {

void add_kitchen_rows(const SpeedOptions& options, const std::string& kind, const std::string& what) {
  for (const double d : options.resolutions)
    for (const int threads : options.threads) {
      Heat& heat = kitchen_heat(options, d);
      const std::string ours = enter_ours(heat, kind, kitchen_scans(options, 0), d, threads);
      register_row({kind + "/kitchen/" + resolution_name(d) + "/threads:" + std::to_string(threads),
                    what + ", kitchen, " + centimetres(d) + with_threads(threads), octomap_insertion,
                    [&heat, ours] { return occupancy_numbers(heat, ours); }});
    }
}

}  // namespace

void add_occupancy_rows(const SpeedOptions& options) {
  add_kitchen_rows(options, "occupancy", "occupancy insertion");
}

void add_plain_rows(const SpeedOptions& options) {
  add_kitchen_rows(options, "plain", "`insert_point_cloud` into a plain `octomap::OcTree`");
}

void add_lidar_rows(const SpeedOptions& options) {
  simulation::SimulationOptions spinning;
  spinning.scene = "office";
  spinning.sensor = "spinning";
  struct Place {
    ScanSet scans;
    double resolution;
    std::string what;
  };
  const Place places[] = {
      {hall_scans(options.count(4, 0)), 0.05, "real lidar in a hall"},
      {simulated_scans(spinning, options.count(5, 40)), 0.02, "simulated spinning lidar, office"}};
  for (const Place& place : places) {
    const std::string key = "lidar/" + place.scans.name + "/" + resolution_name(place.resolution);
    Heat& heat = Heat::of(key, place.scans);
    heat.enter("octomap", "octomap", settings_for(place.scans, place.resolution));
    for (const int threads : options.threads) {
      const std::string ours = enter_ours(heat, "occupancy", place.scans, place.resolution, threads);
      register_row({key + "/threads:" + std::to_string(threads),
                    "occupancy insertion, " + place.what + ", " + centimetres(place.resolution) +
                        with_threads(threads),
                    octomap_insertion, [&heat, ours] { return occupancy_numbers(heat, ours); }});
    }
  }
}

void add_mapper_rows(const SpeedOptions& options) {
  for (const double d : options.resolutions) {
    Heat& heat = kitchen_heat(options, d);
    const std::string ours = enter_mapper(heat, kitchen_scans(options, 0), d);
    register_row({"mapper/kitchen/" + resolution_name(d),
                  "whole scan (occupancy and surfaces), kitchen, " + centimetres(d) + ", one thread",
                  octomap_insertion, [&heat, ours] { return mapper_numbers(heat, ours, "octomap"); }});
  }
}

void add_pcl_rows(const SpeedOptions& options) {
  struct Setting {
    double resolution, radius;
    std::size_t brief, full;
  };
  // At 1 cm with r = 0.15 a single frame takes PCL the better part of a minute.
  for (const Setting& setting :
       {Setting{0.02, 0.15, 8, 100}, Setting{0.02, 0.06, 8, 100}, Setting{0.01, 0.06, 3, 20}}) {
    const ScanSet scans = kitchen_scans(options, options.count(setting.brief, setting.full));
    char name[64];
    std::snprintf(name, sizeof name, "pcl/kitchen/d:%g/r:%g", setting.resolution, setting.radius);
    Heat& heat = Heat::of(name, scans);
    const std::string ours = enter_mapper(heat, scans, setting.resolution);
    Json settings = settings_for(scans, setting.resolution);
    settings["small_radius"] = setting.radius < 0.1;
    heat.enter("paper", "paper", settings);
    char against[96];
    std::snprintf(against, sizeof against, "PCL pipeline, r = %g m", setting.radius);
    register_row({name, "whole scan, kitchen frame by frame, " + centimetres(setting.resolution), against,
                  [&heat, ours] { return mapper_numbers(heat, ours, "paper"); }});
  }
}

void add_memory_rows(const SpeedOptions& options) {
  for (const double d : options.resolutions) {
    Heat& heat = kitchen_heat(options, d);
    const std::string ours = enter_ours(heat, "occupancy", kitchen_scans(options, 0), d, 1);
    register_row({"memory/kitchen/" + resolution_name(d), "heap per octree leaf, kitchen, " + centimetres(d),
                  "OctoMap's pruned tree", [&heat, ours] {
                    // The same occupancy, so the same leaves: OctoMap's count is both sides' divisor.
                    const Json &our = heat.told(ours), &their = heat.told("octomap");
                    const double leaves = number(their, "leaves");
                    return Numbers{{"ours_bytes", number(our, "heap") / leaves},
                                   {"theirs_bytes", number(their, "heap") / leaves},
                                   {"ratio", number(their, "heap") / number(our, "heap")},
                                   {"tree_alone_bytes", number(our, "tree_bytes") / leaves},
                                   {"our_leaves", number(our, "leaves")},
                                   {"their_leaves", leaves}};
                  }});
  }
}

namespace {

/// Each time in processes of their own, as after a restart.
Numbers loading_numbers(const std::string& stem, bool against_octomap, double anew_ms) {
  constexpr int repeats = 7;
  std::vector<Turn> ours, theirs;
  for (int i = 0; i < repeats; ++i) {
    Contest contest;
    contest.enter("ours", "load_map", {{"file", stem}});
    contest.enter("theirs", "read_binary", {{"file", stem + ".bt"}});
    contest.run(i % 2 == 0 ? "ours" : "theirs");
    contest.run(i % 2 == 0 ? "theirs" : "ours");
    ours.push_back(contest.turns("ours").back());
    theirs.push_back(contest.turns("theirs").back());
  }
  if (against_octomap) return compare(ours, theirs);
  const double ms = median(milliseconds(ours));
  return {{"ours_ms", ms}, {"theirs_ms", anew_ms}, {"ratio", anew_ms / ms}};
}

}  // namespace

void add_loading_rows(const SpeedOptions& options) {
  for (const double d : options.resolutions) {
    Heat& heat = kitchen_heat(options, d);
    const std::string ours = enter_mapper(heat, kitchen_scans(options, 0), d);
    const auto measure = [&heat, ours](bool against_octomap) {
      const double anew_ms = sum(milliseconds(heat.turns(ours)));
      return loading_numbers(heat.told(ours).at("stem").get<std::string>(), against_octomap, anew_ms);
    };
    const std::string what = "loading the saved kitchen, " + centimetres(d);
    register_row({"loading/anew/" + resolution_name(d), what, "mapping it anew",
                  [measure] { return measure(false); }});
    register_row({"loading/readBinary/" + resolution_name(d), what, "OctoMap's readBinary",
                  [measure] { return measure(true); }});
  }
}

}  // namespace octosurf::bench
