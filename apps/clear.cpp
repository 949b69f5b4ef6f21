// `octosurf clear`: takes back what a map knows of a part of space.
#include "geometry/interruption.hpp"
#include "interrupt_guard.hpp"
#include "io/map_lock.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "run_statistics.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/space_part.hpp>

namespace octosurf {
namespace {

constexpr const char* clear_description = R"(Takes back what a map knows of a part of space.

Examples:
  octosurf clear maps/office --box 1 0 0 2 1 1.8 --force           a cupboard that was carried out, in its files
  octosurf clear maps/office --cylinder 3 1 0 0.4 1.9 -o maps/new  where somebody stood, into other files

Voxels with their middle inside become unknown (--free: free) and leave their surfaces; surfaces without enough of
them go. What is there is found again by later scans (map --resume). The map keeps no scans.
)";

struct ClearOptions {
  std::string map, output;
  std::vector<double> box, cylinder;
  bool as_free = false, force = false;
};

SpacePart part_of(const ClearOptions& options) {
  const std::vector<double>& c = options.cylinder;
  if (!c.empty() && !(c[3] > 0 && c[4] > 0))
    throw Error(Error::Kind::usage, "--cylinder", "is empty", "give a radius and a height above 0, in m");
  if (!c.empty()) return SpacePart::cylinder({c[0], c[1], c[2]}, c[3], c[4]);
  const Eigen::Vector3d one(options.box.data()), other(options.box.data() + 3);
  if ((one.array() == other.array()).any())
    throw Error(Error::Kind::usage, "--box", "is empty", "give two corners that differ in x, y and z");
  return SpacePart::box({one.cwiseMin(other), one.cwiseMax(other)});
}

void run_clear(const ClearOptions& options) {
  const std::string output = options.output.empty() ? options.map : options.output;
  const SpacePart part = part_of(options);
  require_map_writable(output, options.force);
  const InterruptGuard guard;
  const io::MapLock lock(output);
  LoadedMap loaded = load_with_warning(options.map);
  Mapper mapper(std::move(loaded.map), 1, paper_detector());
  const OccupancyView before = mapper.map().octree();
  const ScanReport report = mapper.clear(part, options.as_free);
  bool changed = false;
  mapper.map().octree().for_each_change(before, [&](auto&&...) { changed = true; });
  if (!changed)
    throw Error(Error::Kind::data, options.map, "nothing is known of that part of space",
                "nothing is written");
  geometry::end_if_interrupted();
  RunContext().warn(save_map(mapper.map(), output));
  std::printf("%s.surfaces: %zu points taken back; %zu surfaces gone, %zu smaller, %zu left\n",
              output.c_str(), report.vanished, report.gone.size(), report.shrunk.size(),
              mapper.snapshot()->surfaces.size());
}

}  // namespace

void add_clear(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("clear", clear_description);
  const auto options = std::make_shared<ClearOptions>();
  verb->add_option("map", options->map, "map: name without ending, as given to map -o")->required();
  CLI::Option_group* part = verb->add_option_group("part", "of space; one of");
  part->add_option("--box", options->box, "X Y Z X Y Z: two opposite corners, m")->expected(6);
  part->add_option("--cylinder", options->cylinder,
                   "X Y Z RADIUS HEIGHT: upright, from the middle of its base, m")
      ->expected(5);
  part->require_option(1);
  verb->add_flag("--free", options->as_free, "what was known becomes free");
  verb->add_option("-o,--output", options->output, "map to write: name without ending [the same map]");
  verb->add_flag("--force", options->force, "overwrite the map");
  verb->callback([options] { run_clear(*options); });
}

}  // namespace octosurf
