// Targets for maps: .surfaces, .bt and .ot.
#include "fuzz/input_file.hpp"
#include "io/map_file/map_file.hpp"
#include "occupancy/occupancy_map.hpp"
#include "support/invariants.hpp"
#include "support/packed_map.hpp"

#include <random>
#include <sstream>

#include <octosurf/mapper.hpp>
#include <octosurf/pieces.hpp>

namespace octosurf::fuzz {
namespace {

/// Some readings about the map's own points, seen from above: they hit, miss and add.
Scan scan_of(const Map& map) {
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.name = "a scan";
  std::minstd_rand rng(1);  // fixed: an input costs the same in each run, so that a finding repeats
  const auto noise = [&] { return 0.2F * (static_cast<float>(rng() % 1000) / 1000 - 0.5F); };
  std::size_t n = 0;
  map.for_each_point([&](const OccupancyView::Voxel& voxel) {
    if (n++ % 7 != 0 || scan.points.size() > 500) return;
    scan.points.push_back(voxel.point.cast<float>() + Eigen::Vector3f(noise(), noise(), noise()));
  });
  Eigen::Vector3f sensor = Eigen::Vector3f::Zero();
  if (!scan.points.empty()) sensor = scan.points.front() + Eigen::Vector3f(0.3F, 0.2F, 1.5F);
  for (Eigen::Vector3f& p : scan.points) p -= sensor;
  scan.T_map_sensor.translation() = sensor.cast<double>();
  return scan;
}

/// What a planner asks of each surface.
void plan_on(const Map& map) {
  for (const SurfacePtr& surface : map.snapshot()->surfaces) {
    simplified(*surface);
    for (const ConvexPiece& piece : convex_pieces(*surface, surface->polygons))
      promise(piece.vertices.size() >= 3 && piece.A.rows() == piece.b.size(), "a convex piece is one");
    extrude(*surface, 0.02);
  }
}

std::string saved(const Map& map) { return test::map_file_of(surfaces::state_of(map)); }

std::optional<Map> loaded(const std::string& bytes) {
  const test::MapBytes input(bytes);
  auto file = accepted([&] { return io::read_map(input.path()); });
  if (!file) return {};
  return surfaces::map_of(std::move(file->state));
}

/// Parameters under which one scan is soon done: a map's are its owner's to choose.
bool cheap(const Parameters& p) {
  return p.max_hole_size() <= 16 * p.occupancy.resolution &&
         p.search_radius() <= 8 * p.occupancy.resolution && p.occupancy.resolution >= 0.01;
}

}  // namespace

void fuzz_surfaces(Bytes bytes) {
  std::optional<Map> map = loaded({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!map) return;
  const std::size_t peak = reading_peak;
  const std::string again = saved(*map);
  promise(loaded(again).has_value(), "what was read can be saved and read again");
  test::check_invariants(*map);
  plan_on(*map);
  if (cheap(map->parameters())) {
    const Scan scan = scan_of(*map);
    Mapper mapper(std::move(*map));
    if (accepted([&] { return (mapper.insert(scan), true); })) {
      plan_on(mapper.map());
      promise(loaded(saved(mapper.map())).has_value(), "what was mapped can be saved and read again");
    }
  }
  reading_peak = peak;
}

void fuzz_octomap(Bytes bytes) {
  const InputFile file(bytes, ".bt");
  const auto map = accepted([&] {
    auto read = occupancy::OccupancyMap::read_octomap(file.path(), {});
    read.adopt_occupied_voxels();
    return read;
  });
  if (!map) return;
  std::ostringstream bt;
  occupancy::write_bt(map->now(), bt);
  map->size();
}

}  // namespace octosurf::fuzz
