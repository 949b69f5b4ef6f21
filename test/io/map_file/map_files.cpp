#include "map_files.hpp"

#include "alignment/alignment_state.hpp"
#include "io/map_file/map_file.hpp"
#include "io/map_file/records.hpp"
#include "support/packed_map.hpp"
#include "support/random_scans.hpp"
#include "support/round_scene.hpp"

namespace octosurf::test {
namespace {

std::string octree_of(const surfaces::MapState& state) {
  std::string bytes;
  occupancy::for_each_part(state.occupancy.now(), {}, [&](std::uint64_t path, const std::string& nodes) {
    bytes += std::to_string(path) + nodes;
  });
  return bytes;
}

// What has to be equal of two of a kind.
auto parts(const Plane& p) { return std::tie(p.normal, p.offset); }
auto parts(const geometry::Moments& m) { return std::tie(m.count, m.sum, m.outer); }
auto parts(const surfaces::Inlier& i) { return std::tie(i.key, i.range_class, i.position); }
auto parts(const std::pair<const geometry::VoxelKey, surfaces::Inlier>& i) {
  return std::tuple_cat(std::tie(i.first), parts(i.second));
}
auto parts(const Polygon& p) { return std::tie(p.outer, p.holes); }
auto parts(const CylinderPtr& c) {
  return std::tie(c->id, c->axis_point, c->axis, c->radius_m, c->length_m, c->start, c->span_rad, c->inliers,
                  c->rms_m, c->born, c->revision);
}
auto parts(const surfaces::CylinderModel& c) {
  return std::tie(c.shape.point, c.shape.axis, c.shape.radius, c.born, c.revision, c.unchecked);
}
auto parts(const surfaces::SurfaceModel::State& s) {
  return std::tie(s.id, s.pose.matrix(), s.hash_frame.matrix(), s.reference, s.evidence.readings,
                  s.covariance, s.parents, s.polygons_stale, s.born, s.revision, s.checked_size);
}
auto parts(const Surface& s) {
  return std::tie(s.id, s.resolution, s.color, s.parents, s.T_map_surface.matrix(), s.boundary, s.area_m2,
                  s.inliers, s.rms_m, s.covariance, s.born, s.revision);
}

template <class T>
bool same(const T& a, const T& b) {
  if constexpr (requires { parts(a); })
    return parts(a) == parts(b);
  else
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const auto& x, const auto& y) { return same(x, y); });
}

bool same_state(const surfaces::SurfaceModel::State& a, const surfaces::SurfaceModel::State& b) {
  return same(a, b) && same(a.plane, b.plane) && same(a.moments, b.moments) &&
         same(a.evidence.moments, b.evidence.moments) && same(a.inliers, b.inliers) &&
         same(a.polygons, b.polygons);
}

bool same_cylinders(const surfaces::CylinderStore& a, const surfaces::CylinderStore& b) {
  return a.next_id() == b.next_id() && a.size() == b.size() && std::ranges::all_of(a, [&](const auto& one) {
           const surfaces::CylinderModel* other = b.find(one.first);
           return other != nullptr && same(one.second, *other) && same(one.second.inliers, other->inliers);
         });
}

std::vector<Removal> all_of(const RemovalLog& log) {
  std::vector<Removal> all;
  log.for_each_since(0, [&](const Removal& removal) { all.push_back(removal); });
  return all;
}

std::string snapshot_difference(const Snapshot& a, const Snapshot& b) {
  if (a.revision != b.revision || a.resolution != b.resolution) return "snapshot's revision or resolution";
  if (!std::ranges::equal(a.surfaces, b.surfaces, [](const SurfacePtr& one, const SurfacePtr& other) {
        return same(*one, *other) && same(one->plane, other->plane) && same(one->polygons, other->polygons);
      }))
    return "published surfaces";
  if (!same(a.cylinders, b.cylinders)) return "published cylinders";
  return all_of(a.removals) == all_of(b.removals) ? "" : "published removals";
}

}  // namespace

std::string MapFiles::loading(const std::string& content) const {
  write_file(folder / "map.surfaces", content);
  try {
    load_map(folder / "map");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), Error::Kind::data) << error.what();
    EXPECT_NE(error.hint(), "") << error.what();
    return error.what();
  }
  return "loaded";
}

Parameters coarse() {
  Parameters parameters;
  parameters.occupancy.resolution = 0.05;
  return parameters;
}

std::vector<Scan> changing_room(std::size_t scans, std::mt19937_64 rng) {
  std::vector<Scan> all;
  for (std::size_t i = 0; i + 2 < scans; ++i)
    all.push_back(room_scan(rng, 2500, {i < 5 ? 0.9 : 1.3, 1.1, 0.7}, {0.3, -0.2, 0.1}));
  for (const float z : {2.1F, 2.4F}) {  // where no ray has been
    Scan& few = all.emplace_back();
    for (const float x : {0.1F, 0.3F, 0.5F}) few.points.emplace_back(x, 0.2F - x, z);
  }
  return all;
}

std::vector<Scan> pillar(std::size_t scans, std::size_t gone, std::mt19937_64 rng) {
  RoundScene scene;
  scene.flat.rectangle({-2, -2, 0.01}, {4, 0, 0}, {0, 4, 0});
  scene.flat.rectangle({-2, -2, 0}, {4, 0, 0}, {0, 0, 3}).rectangle({-2, -2, 0}, {0, 4, 0}, {0, 0, 3});
  scene.bars.push_back({{0.1, 0.2, 0}, {0.1, 0.2, 1.8}, 0.3});
  Camera small;
  small.width = 120;
  small.height = 90;
  small.focal = 100;
  std::vector<Scan> all;
  for (std::size_t i = 0; i < scans; ++i) {
    if (i + gone == scans) scene.bars.clear();
    const double a = 0.3 * static_cast<double>(i % 6);
    const Eigen::Vector3d target(0.1, 0.2, 0.8);
    const Eigen::Vector3d eye = target + Eigen::Vector3d(1.8 * std::cos(a), 1.8 * std::sin(a), 0.4);
    all.push_back(camera_scan(scene, look_at(eye, target), rng, small));
  }
  return all;
}

Map map_of(const std::vector<Scan>& scans, const Parameters& parameters) {
  Mapper mapper(parameters);
  for (const Scan& scan : scans) mapper.insert(scan);
  return std::move(mapper).release();
}

std::string bytes_of(const Map& map) { return map_file_of(surfaces::state_of(map)); }

/// Every number of it, exactly.
std::string alignment_bytes(const surfaces::MapState& state) {
  map_file::Alignment record;
  io::write_alignment(alignment::record_of(state).state, record);
  return record.SerializeAsString();
}

std::string patch_bytes(const surfaces::MapState& state) {
  map_file::SeenPatches record;
  const alignment::SeenPatches& patches = alignment::record_of(state).patches;
  for (const alignment::SeenPatches::Key block : patches.blocks())
    for (const alignment::SeenPatches::Change& patch : patches.in_block(block))
      io::write_patch(patch, record);
  return record.SerializeAsString();
}

std::string difference(const Map& map_a, const Map& map_b) {
  const surfaces::MapState &a = surfaces::state_of(map_a), &b = surfaces::state_of(map_b);
  for (const ParameterInfo& info : parameter_infos())
    if (parameter_value(a.parameters, info.name) != parameter_value(b.parameters, info.name))
      return info.name;
  if (octree_of(a) != octree_of(b)) return "octree";
  if (a.queue != b.queue) return "queue";
  if (a.held != b.held) return "scans that it holds";
  if (all_of(a.removals) != all_of(b.removals)) return "removals";
  if (a.points != b.points || a.scans != b.scans || a.revision != b.revision) return "counts";
  if (a.sensors_up != b.sensors_up) return "sensors' up";
  if (a.noise.histogram() != b.noise.histogram() || a.noise.range_noise() != b.noise.range_noise())
    return "noise";
  for (unsigned c = 0; c < sensing::NoiseModel::classes; ++c)
    if (a.noise.sigma(c) != b.noise.sigma(c) || a.noise.tolerance(c) != b.noise.tolerance(c)) return "sigma";
  if (alignment_bytes(a) != alignment_bytes(b)) return "alignment";
  if (patch_bytes(a) != patch_bytes(b)) return "patches";
  if (a.surfaces.next_id() != b.surfaces.next_id()) return "next id";
  if (a.surfaces.size() != b.surfaces.size()) return "number of surfaces";
  const auto published_a = map_a.snapshot(), published_b = map_b.snapshot();
  for (const auto& [id, surface] : a.surfaces) {
    const surfaces::SurfaceModel* other = b.surfaces.find(id);
    if (other == nullptr || !same_state(surface.state(published_a.get()), other->state(published_b.get())))
      return "surface " + std::to_string(id);
  }
  if (!same_cylinders(a.cylinders, b.cylinders)) return "cylinders";
  return snapshot_difference(*map_a.snapshot(), *map_b.snapshot());
}

std::vector<map_file::Record> unpack(const std::string& file) {
  std::vector<map_file::Record> records;
  for (const std::string& bytes : records_of(file))
    if (!records.emplace_back().ParseFromString(bytes)) throw std::runtime_error("not a record");
  if (records.empty()) throw std::runtime_error("not a map file");
  return records;
}

map_file::Surface& last_surface(std::vector<map_file::Record>& records) {
  const auto last = std::find_if(records.rbegin(), records.rend(),
                                 [](const map_file::Record& record) { return record.has_surface(); });
  if (last == records.rend()) throw std::runtime_error("no surface");
  return *last->mutable_surface();
}

std::string pack(const std::vector<map_file::Record>& records) {
  std::vector<std::string> bytes;
  for (const map_file::Record& record : records) bytes.push_back(record.SerializeAsString());
  return map_file_of(bytes);
}

}  // namespace octosurf::test
