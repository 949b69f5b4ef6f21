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
  state.occupancy.write_nodes([&](const std::string& chunk) { bytes += chunk; });
  return bytes;
}

bool same(const Plane& a, const Plane& b) { return a.normal == b.normal && a.offset == b.offset; }

bool same(const geometry::Moments& a, const geometry::Moments& b) {
  return a.count == b.count && a.sum == b.sum && a.outer == b.outer;
}

bool same(const surfaces::Inlier& a, const surfaces::Inlier& b) {
  return a.key == b.key && a.range_class == b.range_class && a.position == b.position;
}

bool same(const Polygon& a, const Polygon& b) { return a.outer == b.outer && a.holes == b.holes; }

bool same(const CylinderPtr& a, const CylinderPtr& b) {
  return a->id == b->id && a->axis_point == b->axis_point && a->axis == b->axis &&
         a->radius_m == b->radius_m && a->length_m == b->length_m && a->start == b->start &&
         a->span_rad == b->span_rad && a->inliers == b->inliers && a->rms_m == b->rms_m &&
         a->born == b->born && a->revision == b->revision;
}

bool same(const std::pair<const geometry::VoxelKey, surfaces::Inlier>& a,
          const std::pair<const geometry::VoxelKey, surfaces::Inlier>& b) {
  return a.first == b.first && same(a.second, b.second);
}

template <class Range>
bool all_same(const Range& a, const Range& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return same(x, y); });
}

std::string surface_difference(const surfaces::SurfaceModel::State& a,
                               const surfaces::SurfaceModel::State& b) {
  if (a.id != b.id) return "id";
  if (!same(a.plane, b.plane)) return "plane";
  if (a.pose.matrix() != b.pose.matrix()) return "pose";
  if (a.hash_frame.matrix() != b.hash_frame.matrix()) return "hash frame";
  if (a.reference != b.reference) return "reference";
  if (!all_same(a.moments, b.moments)) return "moments";
  if (!same(a.evidence.moments, b.evidence.moments) || a.evidence.readings != b.evidence.readings)
    return "evidence";
  if (a.covariance != b.covariance) return "covariance";
  if (!all_same(a.inliers, b.inliers)) return "inliers";
  if (!all_same(a.polygons, b.polygons)) return "polygons";
  if (a.parents != b.parents) return "parents";
  if (a.polygons_stale != b.polygons_stale) return "polygons_stale";
  if (a.born != b.born || a.revision != b.revision || a.checked_size != b.checked_size)
    return "born, revision or checked size";
  return {};
}

std::string published_difference(const Surface& a, const Surface& b) {
  if (a.id != b.id || a.resolution != b.resolution || a.color != b.color || a.parents != b.parents)
    return "id, colour or parents";
  if (!same(a.plane, b.plane) || a.T_map_surface.matrix() != b.T_map_surface.matrix()) return "plane or pose";
  if (!all_same(a.polygons, b.polygons)) return "polygons";
  if (a.boundary != b.boundary || a.area_m2 != b.area_m2) return "boundary or area";
  if (a.inliers != b.inliers || a.rms_m != b.rms_m) return "inliers or rms";
  if (a.covariance != b.covariance) return "covariance";
  if (a.born != b.born || a.revision != b.revision) return "born or revision";
  return {};
}

std::string cylinder_difference(const surfaces::CylinderStore& a, const surfaces::CylinderStore& b) {
  if (a.next_id() != b.next_id()) return "next cylinder id";
  if (a.size() != b.size()) return "number of cylinders";
  for (const auto& [id, cylinder] : a) {
    const surfaces::CylinderModel* other = b.find(id);
    if (other == nullptr) return "cylinder's id";
    if (cylinder.shape.point != other->shape.point || cylinder.shape.axis != other->shape.axis ||
        cylinder.shape.radius != other->shape.radius)
      return "cylinder's shape";
    if (!all_same(cylinder.inliers, other->inliers)) return "cylinder's inliers";
    if (cylinder.born != other->born || cylinder.revision != other->revision ||
        cylinder.unchecked != other->unchecked)
      return "cylinder's born, revision or unchecked";
  }
  return {};
}

std::vector<Removal> all_of(const RemovalLog& log) {
  std::vector<Removal> all;
  log.for_each_since(0, [&](const Removal& removal) { all.push_back(removal); });
  return all;
}

std::string snapshot_difference(const Snapshot& a, const Snapshot& b) {
  if (a.revision != b.revision || a.resolution != b.resolution) return "snapshot's revision or resolution";
  if (a.surfaces.size() != b.surfaces.size()) return "number of published surfaces";
  for (std::size_t i = 0; i < a.surfaces.size(); ++i)
    if (const std::string d = published_difference(*a.surfaces[i], *b.surfaces[i]); !d.empty())
      return "published surface's " + d;
  if (!all_same(a.cylinders, b.cylinders)) return "published cylinders";
  if (all_of(a.removals) != all_of(b.removals)) return "published removals";
  return {};
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

std::string bytes_of(const Map& map) {
  std::ostringstream out;
  io::write_map(surfaces::state_of(map), {}, out);
  return out.str();
}

/// Every number of it, exactly.
std::string alignment_bytes(const surfaces::MapState& state) {
  map_file::Alignment record;
  io::write_alignment(alignment::record_of(state).state, record);
  return record.SerializeAsString();
}

std::string patch_bytes(const surfaces::MapState& state) {
  map_file::SeenPatches record;
  for (const alignment::SeenPatches::Change& patch : alignment::record_of(state).patches.all())
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
    const std::string d = other == nullptr ? "id"
                                           : surface_difference(surface.state(published_a.get()),
                                                                other->state(published_b.get()));
    if (!d.empty()) return "surface's " + d;
  }
  if (const std::string d = cylinder_difference(a.cylinders, b.cylinders); !d.empty()) return d;
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

void expect_refused_when_damaged(const std::string& good, const std::string& kind,
                                 const std::function<std::string(const std::string&)>& reading,
                                 const std::function<std::string()>& read_back) {
  using ::testing::HasSubstr;
  const auto refused = ::testing::AnyOf(HasSubstr("is damaged"), HasSubstr(kind));
  for (std::size_t n = 0; n < good.size(); n += n < 40 ? 1 : good.size() / 100)
    ASSERT_THAT(reading(good.substr(0, n)), refused) << n;
  EXPECT_THAT(reading(good + '\0'), HasSubstr("left over"));
  std::mt19937_64 random = rng();
  for (int round = 0; round < 400; ++round) {
    std::string bytes = good;
    const std::size_t at = round < 100 ? static_cast<std::size_t>(round) : random() % bytes.size();
    bytes[at] = static_cast<char>(bytes[at] ^ 1 << random() % 8);
    if (reading(bytes) == "read") {  // a bit that zstd does not look at
      ASSERT_EQ(read_back(), good) << at;
    }
  }
  std::string newer = good;
  newer[8] = 2;
  EXPECT_THAT(reading(newer), HasSubstr("has version 2"));
  EXPECT_THAT(reading("\x89PNG\r\n\x1a\n"), HasSubstr(kind));
}

}  // namespace octosurf::test
