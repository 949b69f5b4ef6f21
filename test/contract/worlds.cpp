#include "contract/worlds.hpp"

#include "alignment/surfaces_by_hand.hpp"
#include "io/map_file/map_files.hpp"
#include "simulation/recording.hpp"
#include "support/invariants.hpp"
#include "support/room_tour.hpp"
#include "surfaces/map_state.hpp"

namespace octosurf::test {
namespace {

/// One reading in `every` of a simulated sensor.
std::vector<Scan> thinned(simulation::SimulationOptions options, std::size_t every) {
  options.seed = seed();
  const simulation::Recording recording(options);
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    Scan scan = recording.scan(i);
    std::vector<Eigen::Vector3f> kept;
    for (std::size_t k = i % every; k < scan.points.size(); k += every) kept.push_back(scan.points[k]);
    scan.points = std::move(kept);
    scans.push_back(std::move(scan));
  }
  return scans;
}

std::vector<Scan> simulated(const std::string& scene, std::size_t frames,
                            const std::string& sensor = "depth") {
  simulation::SimulationOptions options;
  options.scene = scene;
  options.sensor = sensor;
  options.frames = frames;
  return thinned(options, 8);
}

/// Three laps of a corridor, whose poses are off by 15 cm and 1° after each.
std::vector<Scan> walk_that_drifts() {
  simulation::SimulationOptions options;
  options.scene = "corridor";
  options.frames = 60;
  options.length = 8;
  options.laps = 3;
  options.drift_m = 0.15;
  options.drift_rad = std::numbers::pi / 180;
  return thinned(options, 25);
}

/// A camera that sways in a room, before which people stand from scan 12 on, elsewhere at each scan.
std::vector<Scan> crowd() {
  std::mt19937_64 random = rng();
  std::uniform_real_distribution<double> beside(-0.9, 0.9);
  std::vector<Scan> scans;
  for (int i = 0; i < 24; ++i) {
    Scene scene;
    scene.box({-3, -2.5, 0.01}, {3, 2.5, 2.6}).box({1, -2.5, 0.01}, {2, -1.7, 0.75});
    scene.box({-3, 1, 0.01}, {-2.2, 2.5, 0.45}).box({2.4, 0, 0.01}, {2.99, 1, 1.8});
    const double turn = 2 * std::numbers::pi * i / 40, yaw = 0.2 * std::sin(turn);
    const Eigen::Vector3d eye(0.6 * std::cos(turn) - 0.5, 0.6 * std::sin(turn), 1.3);
    const auto person = [&](double ahead, double aside, double width) {
      const Eigen::Vector3d at(eye.x() + ahead, eye.y() + aside, 0.01), half(width / 2, width / 2, 0);
      scene.box(at - half, at + half + Eigen::Vector3d(0, 0, 1.75));
    };
    const double aside = beside(random);
    if (i >= 12) person(1.5, aside, 0.7);
    if (i >= 12) person(1.9, -aside, 0.6);
    const Camera camera{.width = 96, .height = 72, .focal = 80, .noise = 0.004};
    scans.push_back(camera_scan(
        scene, look_at(eye, eye + Eigen::Vector3d(std::cos(yaw), std::sin(yaw), -0.3)), random, camera));
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
      {"PosesThatDrift", of_voxels(0.05), &walk_that_drifts, {&S::corrected}},
      {"ACrowd", of_voxels(0.05), &crowd, {&S::vanished}},
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
