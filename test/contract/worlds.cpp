#include "contract/worlds.hpp"

#include "alignment/surfaces_by_hand.hpp"
#include "io/map_file/map_files.hpp"
#include "simulation/recording.hpp"
#include "support/invariants.hpp"
#include "support/room_tour.hpp"
#include "surfaces/map_state.hpp"

namespace octosurf::test {
namespace {

/// One reading in eight of a simulated sensor.
std::vector<Scan> simulated(const std::string& scene, std::size_t frames,
                            const std::string& sensor = "depth") {
  simulation::SimulationOptions options;
  options.scene = scene;
  options.sensor = sensor;
  options.frames = frames;
  options.seed = seed();
  const simulation::Recording recording(options);
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    Scan scan = recording.scan(i);
    std::vector<Eigen::Vector3f> thinned;
    for (std::size_t k = i % 8; k < scan.points.size(); k += 8) thinned.push_back(scan.points[k]);
    scan.points = std::move(thinned);
    scans.push_back(std::move(scan));
  }
  return scans;
}

/// A walk about a room, and twice again with poses that are 5 cm off.
std::vector<Scan> walk_that_jumps() {
  std::mt19937_64 random = rng();
  const Camera camera{.width = 160, .height = 120, .focal = 110, .noise = 0.003};
  constexpr int lap = 8;
  std::vector<Scan> scans;
  for (int i = 0; i < 3 * lap; ++i) {
    const double turn = 2 * std::numbers::pi * i / lap;
    const auto round = [&](double x, double y, double z, double ahead) -> Eigen::Vector3d {
      return middle_of_room + Eigen::Vector3d(x * std::cos(turn + ahead), y * std::sin(turn + ahead), z);
    };
    scans.push_back(camera_scan(furnished_room(), look_at(round(0.5, 0.7, 0.2, 0), round(2, 2.5, -0.7, 0.6)),
                                random, camera));
    if (i >= lap) scans.back().T_map_sensor.pretranslate(Eigen::Vector3d(0.05, 0, 0));
  }
  return scans;
}

void count(const ScanReport& report, const Map& map, Seen& seen) {
  const surfaces::MapState& state = surfaces::state_of(map);
  seen.surfaces += state.surfaces.size();
  seen.waiting += state.queue.fresh.size();
  for (const auto& [id, surface] : state.surfaces) seen.seen_again += surface.evidence().readings > 100;
  for (const auto snapshot = map.snapshot(); const SurfacePtr& surface : snapshot->surfaces)
    for (const Polygon& polygon : surface->polygons) seen.holes += polygon.holes.size();
  for (const auto& range_class : state.noise.histogram())
    seen.observed += std::accumulate(range_class.begin(), range_class.end(), std::size_t{0});
  seen.cylinders_gone += seen.cylinders > 0 && state.cylinders.size() == 0;
  seen.cylinders += state.cylinders.size();
  seen.vanished += report.vanished;
  seen.corrected += report.alignment.outcome == AlignmentOutcome::corrected;
}

Mapped made(const World& world) {
  Mapped run;
  run.scans = world.scans();
  Mapper mapper(world.parameters, 1, paper_detector());
  for (const Scan& scan : run.scans) {
    const ScanReport report = mapper.insert(scan);
    count(report, mapper.map(), run.seen);
    run.bytes.push_back(bytes_of(mapper.map()));
    run.grown.push_back(report.grown);
    run.wrong.push_back(check_invariants(mapper.map()));
  }
  run.map = std::move(mapper).release();
  return run;
}

}  // namespace

const std::vector<World>& worlds() {
  using S = Seen;
  static const std::vector<World> all{
      {"Room", {}, [] { return room_tour(rng(), 8); }, {&S::surfaces, &S::observed}},
      {"WallsThatMove",
       coarse(),
       [] { return changing_room(14); },
       {&S::surfaces, &S::waiting, &S::vanished}},
      {"WithThePapersDetector",
       Parameters::paper(0.05),
       [] { return changing_room(14); },
       {&S::surfaces, &S::waiting}},
      {"APillarThatGoes",
       coarse(),
       [] { return pillar(30, 20); },
       {&S::cylinders, &S::cylinders_gone, &S::vanished}},
      {"Office", of_voxels(0.04), [] { return simulated("office", 12); }, {&S::holes, &S::seen_again}},
      {"ThingsThatMove", of_voxels(0.04), [] { return simulated("change", 12); }, {&S::vanished}},
      {"ALidar", of_voxels(0.1), [] { return simulated("room", 4, "spinning"); }, {&S::surfaces}},
      {"PosesThatJump", of_voxels(0.04), &walk_that_jumps, {&S::corrected}},
  };
  return all;
}

const Mapped& run_of(const World& world) {
  static std::map<std::pair<std::string, std::uint64_t>, Mapped> runs;
  const std::pair key(std::string(world.name), seed());
  const auto found = runs.find(key);
  if (found != runs.end()) return found->second;
  std::erase_if(runs, [&](const auto& run) { return run.first.first == world.name; });  // of another seed
  return runs.emplace(key, made(world)).first->second;
}

}  // namespace octosurf::test
