#include "io/map_file/map_file.hpp"
#include "io/map_file/record_numbers.hpp"
#include "io/map_file/records.hpp"
#include "io/text_file.hpp"
#include "map_file.pb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::size_t longest_path = 4096;
constexpr std::size_t small_record_limit = std::size_t{1} << 20;
constexpr std::uint32_t length_delimited = 2;  // protobuf's wire type
constexpr std::uint32_t last_next_id = 1U << 24;
/// Parameters of earlier versions that have a fixed value now, or none.
constexpr std::array<std::string_view, 5> retired_parameters{
    "normal_radius", "smoothness_angle", "max_curvature", "ransac_iterations", "mesh_thickness"};
constexpr double largest_integer = 1e9;  // limit of a parameter; real ones are far below

/// A parsed record: its field number, and that field's bytes.
struct RecordView {
  int field = 0;
  std::string_view content;
};

class MapReader : Damage {
 public:
  MapReader(std::istream& in, std::uint64_t file_bytes, const std::string& name)
      : Damage{name, {}},
        records_(in, map_stream.most(file_bytes), where),
        most_memory_(map_memory.most(file_bytes)) {
    advance();
  }

  MapFile operator()() {
    read_header();
    read_octree();
    read_queue();
    read_scan_poses();
    read_surfaces();
    read_cylinders();
    read_removals();
    read_seen_patches();
    read_footer();
    publish();
    return std::move(file_);
  }
  FileSum octree_sum() {
    read_header();
    while (record_.field != 0 && record_.field != map_file::Record::kFooter) advance();
    read_footer();
    return file_.bt;
  }

 private:
  /// Counts the memory of a part of the map before its allocation.
  void charge(std::uint64_t count, std::uint64_t bytes) {
    memory_ += count * bytes;
    check_memory(0);
  }
  void check_memory(std::uint64_t passing) const {
    require(memory_ + passing <= most_memory_, "it takes far more memory than its size allows");
  }

  /// The next record in canonical form: one field with all of its bytes. Its memory is charged by type before
  /// it is parsed.
  void advance() {
    record_ = {};
    if (!records_.next(bytes_)) return;
    google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes_.data()),
                                              static_cast<int>(bytes_.size()));
    std::uint32_t tag = 0, length = 0;
    require(in.ReadVarint32(&tag) && (tag & 7) == length_delimited && in.ReadVarint32(&length) &&
                static_cast<std::size_t>(in.CurrentPosition()) + length == bytes_.size(),
            "a record is not one field");
    record_ = {static_cast<int>(tag >> 3), std::string_view(bytes_).substr(bytes_.size() - length)};
  }

  template <class Message>
  Message parse(std::size_t limit) const {
    Message message;
    require(record_.content.size() <= limit &&
                message.ParseFromArray(record_.content.data(), static_cast<int>(record_.content.size())),
            "a record cannot be read");
    return message;
  }

  void read_header() {
    require(record_.field == map_file::Record::kHeader, "it does not begin with a header");
    auto header = parse<map_file::Header>(small_record_limit);
    file_.state = std::make_unique<surfaces::MapState>(read_parameters(header));
    surfaces::MapState& state = *file_.state;
    require(header.has_revision() && header.has_scans() && header.has_points() && header.has_next_id() &&
                header.has_range_noise() && header.has_bt_bytes() && header.has_bt_crc32(),
            "the header is not complete");
    state.revision = header.revision();
    state.scans = header.scans();
    state.points = header.points();
    require(state.revision < largest_count && state.scans < largest_count, "its counts make no sense");
    require(header.next_id() >= 1 && header.next_id() <= last_next_id, "there is no such next surface id");
    state.surfaces.set_next_id(header.next_id());
    if (header.has_next_cylinder_id()) {
      require(header.next_cylinder_id() >= 1, "there is no such next cylinder id");
      state.cylinders.set_next_id(header.next_cylinder_id());
    }
    state.sensors_up = vector_of(header.sensors_up(), static_cast<double>(header.scans()) * (1 + 1e-3),
                                 "the sensors' up direction makes no sense");
    if (header.origin_size() > 0)
      state.origin =
          vector_of(header.origin(), std::numeric_limits<double>::max(), "the origin makes no sense");
    if (header.has_alignment())
      alignment::record_of(state).state = read_alignment(*header.mutable_alignment(), where);
    read_noise(header);
    file_.bt = {header.bt_bytes(), header.bt_crc32()};
    require(header.kept_scans().size() <= longest_path && header.kept_scans().find('\0') == std::string::npos,
            "the name of the scans' folder makes no sense");
    file_.scans.folder = header.kept_scans();
    file_.scans.shared = header.kept_scans_shared();
    advance();
  }

  Parameters read_parameters(const map_file::Header& header) const {
    Parameters parameters;
    const auto& infos = parameter_infos();
    for (const map_file::Parameter& p : header.parameters()) {
      if (std::ranges::find(retired_parameters, p.name()) != retired_parameters.end()) continue;
      const bool known =
          std::ranges::any_of(infos, [&](const ParameterInfo& info) { return info.name == p.name(); });
      if (!known)
        throw Error(
            Error::Kind::data, where,
            "has a parameter '" + printable(p.name().substr(0, 64)) + "' that this octosurf does not know",
            "use the newer version that wrote it");
      require(!p.has_value() || std::fabs(p.value()) <= largest_integer, "a parameter makes no sense");
      not_usage([&] {
        set_parameter_value(parameters, p.name(), p.has_value() ? std::optional(p.value()) : std::nullopt);
      });
    }
    not_usage([&] { parameters.validate(); });
    return parameters;
  }
  /// Reports an invalid parameter as damage of the file.
  template <class Work>
  void not_usage(const Work& work) const {
    try {
      work();
    } catch (const Error& error) {
      fail(error.what());
    }
  }

  Eigen::Vector3d vector_of(const google::protobuf::RepeatedField<double>& numbers, double longest,
                            const char* what) const {
    require(numbers.size() == 3, what);
    const Eigen::Vector3d vector(numbers[0], numbers[1], numbers[2]);
    require(vector.norm() <= longest, what);  // NaN fails
    return vector;
  }

  void read_noise(const map_file::Header& header) {
    sensing::NoiseModel::Histogram histogram{};
    require(header.noise_histogram_size() ==
                static_cast<int>(sensing::NoiseModel::classes * sensing::NoiseModel::bins),
            "the noise histogram has another size");
    for (std::size_t i = 0; i < sensing::NoiseModel::classes * sensing::NoiseModel::bins; ++i)
      histogram[i / sensing::NoiseModel::bins][i % sensing::NoiseModel::bins] =
          header.noise_histogram(static_cast<int>(i));
    require(header.range_noise() >= 0 && header.range_noise() <= 1, "the noise makes no sense");
    file_.state->noise.restore(histogram, header.range_noise(), shared_errors(header));
  }

  sensing::NoiseModel::SharedErrors shared_errors(const map_file::Header& header) {
    sensing::NoiseModel::SharedErrors errors{};
    const int size = header.shared_error_variances_size();
    require(size == header.shared_error_scans_size() && size == static_cast<int>(errors.of_class.size()) + 1,
            "the readings' errors have another size");
    const auto read = [&](int i) {
      const sensing::NoiseModel::SharedError error{header.shared_error_variances(i),
                                                   header.shared_error_scans(i)};
      require(error.variance >= 0 && error.variance <= 1 && (error.scans > 0 || error.variance == 0) &&
                  error.scans <= sensing::NoiseModel::residual_memory,
              "the readings' errors make no sense");
      return error;
    };
    for (int c = 0; c + 1 < size; ++c) errors.of_class[static_cast<std::size_t>(c)] = read(c);
    errors.of_surface = read(size - 1);
    return errors;
  }

  void read_octree() {
    surfaces::MapState& state = *file_.state;
    state.occupancy.read_nodes([this] { return next_nodes(); }, where);
    std::size_t points = 0;
    charge(state.occupancy.bytes(), 1);
    state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
      ++points;
      if (p.surface == 0) return;
      charge(1, inlier_cost);
      inliers_[p.surface].push_back({p.key, p.range_class, p.position});
    });
    require(points == state.points, "the octree holds another number of points");
  }

  /// A part of the octree's nodes, small enough to check the memory limit in time.
  std::string next_nodes() {
    constexpr std::size_t piece = std::size_t{16} << 10;  // 0.6 MB at most: eight bytes a brick of 280
    if (record_.field != map_file::Record::kOctree) return {};
    require(!record_.content.empty(), "an octree chunk is empty");
    require(file_.state->occupancy.bytes() <= most_memory_, "it takes far more memory than its size allows");
    std::string nodes(record_.content.substr(0, piece));
    record_.content.remove_prefix(nodes.size());
    if (record_.content.empty()) advance();
    return nodes;
  }

  void read_queue() {
    surfaces::PendingQueue& queue = file_.state->queue;
    KeySteps steps;
    for (; record_.field == map_file::Record::kAccumulated; advance()) {
      const auto accumulated = parse<map_file::Accumulated>(small_record_limit);
      charge(static_cast<std::uint64_t>(accumulated.steps_size() + accumulated.blocks_size()), waiting_cost);
      require(accumulated.steps().empty() || queue.blocks.empty(), "waiting points follow waiting blocks");
      for (const std::uint64_t step : accumulated.steps()) {
        const auto key = steps.from(step);
        if (!key) fail("a waiting point lies outside the octree, or out of order");
        queue.fresh.push_back(*key);
      }
      for (const std::uint64_t block : accumulated.blocks()) {
        require(block < std::uint64_t{1} << 48, "a waiting block lies outside the octree");
        queue.blocks.push_back(geometry::VoxelKey::unpack(block));
      }
    }
  }

  void read_scan_poses() {
    std::vector<Eigen::Isometry3d>& poses = file_.scans.poses;
    std::vector<std::uint32_t>& marks = file_.scans.marks;
    for (; record_.field == map_file::Record::kScanPoses; advance()) {
      auto record = parse<map_file::ScanPoses>(small_record_limit);
      const auto count = static_cast<std::size_t>(record.values_size()) / 12;
      const auto held = static_cast<std::size_t>(record.held_size());
      require(count <= file_.state->scans - poses.size(), "it has poses of scans that are not there");
      require(held <= file_.state->scans - file_.state->held.size(), "it holds scans that are not there");
      charge(count, pose_cost);
      charge(held + static_cast<std::size_t>(record.marks_size()), held_cost);
      marks.insert(marks.end(), record.marks().begin(), record.marks().end());
      file_.state->held.insert(file_.state->held.end(), record.held().begin(), record.held().end());
      for (RecordNumbers<double> values(*record.mutable_values(), this, finite_numbers); !values.at_end();) {
        values(poses.emplace_back(Eigen::Isometry3d::Identity()));
        require_rigid(poses.back(), where);
      }
    }
    require(file_.scans.folder.empty() || poses.size() == file_.state->scans,
            "poses of its scans are missing");
    require(marks.empty() || marks.size() == poses.size(), "marks of its scans are missing");
  }

  void read_surfaces() {
    surfaces::MapState& state = *file_.state;
    SurfaceId last = 0;
    for (; record_.field == map_file::Record::kSurface; advance()) {
      check_memory(record_.content.size());
      auto record = parse<map_file::Surface>(record_limit);
      const auto vertices = static_cast<std::uint64_t>(record.polygons().uv_size()) / 2;
      const auto rings = static_cast<std::uint64_t>(record.polygons().vertices_size());
      charge(1, surface_cost + sizeof(SurfaceId) * static_cast<std::uint64_t>(record.parents_size()));
      charge(vertices + rings, vertex_cost);
      check_memory(vertices * check_cost);
      require(record.id() > last && record.id() < state.surfaces.next_id(),
              "a surface's id is out of order, or not given out yet");
      last = record.id();
      state.surfaces.restore(read_surface(record, take_inliers(last), state, where));
    }
    if (!inliers_.empty()) fail("voxels belong to a surface that is not there");
  }

  void read_cylinders() {
    surfaces::MapState& state = *file_.state;
    CylinderId last = 0;
    for (; record_.field == map_file::Record::kCylinder; advance()) {
      check_memory(record_.content.size());
      auto record = parse<map_file::Cylinder>(record_limit);
      charge(static_cast<std::uint64_t>(record.steps_size()), inlier_cost);
      require(state.parameters.detection.detect_cylinders, "it has cylinders but is not to have any");
      require(record.id() > last && record.id() < state.cylinders.next_id(),
              "a cylinder's id is out of order, or not given out yet");
      last = record.id();
      state.cylinders.restore(read_cylinder(record, state, where));
    }
  }

  void read_removals() {
    for (; record_.field == map_file::Record::kRemovals; advance()) {
      const auto record = parse<map_file::Removals>(small_record_limit);
      std::vector<Removal> removals;
      for (const map_file::Removal& removal : record.removals()) {
        charge(1, removal_cost + sizeof(SurfaceId) * static_cast<std::uint64_t>(removal.parents_size()));
        removals.push_back(read_removal(removal));
      }
      file_.state->removals = file_.state->removals.with(removals);
    }
  }

  /// Checks that the id was assigned, has gone, and departs once and in order.
  Removal read_removal(const map_file::Removal& record) {
    const surfaces::MapState& state = *file_.state;
    const bool cylinder = record.cylinder();
    const std::uint32_t id = record.id(),
                        next_id = cylinder ? state.cylinders.next_id() : state.surfaces.next_id();
    const Damage damage{where, (cylinder ? "cylinder " : "surface ") + std::to_string(id) + " "};
    damage.require(id > 0 && id < next_id, "was never there");
    damage.require(cylinder ? !state.cylinders.find(id) : !state.surfaces.find(id), "has not gone");
    damage.require(gone_.insert({cylinder, id}).second, "has gone twice");
    damage.require(record.into() < next_id && record.into() != id, "has gone into what never was");
    damage.require(record.revision() <= state.revision && record.revision() >= last_gone_ &&
                       record.born() <= record.revision(),
                   "has gone out of order");
    last_gone_ = record.revision();
    for (const SurfaceId parent : record.parents())
      damage.require(!cylinder && parent > 0 && parent < next_id, "has a parent that never was");
    return {cylinder ? Removal::Of::cylinder : Removal::Of::surface,
            id,
            record.into(),
            record.born(),
            record.revision(),
            {record.parents().begin(), record.parents().end()}};
  }

  void read_seen_patches() {
    std::optional<alignment::SeenPatches::Key> last;
    for (; record_.field == map_file::Record::kSeenPatches; advance()) {
      auto record = parse<map_file::SeenPatches>(small_record_limit);
      charge(static_cast<std::uint64_t>(record.keys_size()), patch_cost);
      read_patches(record, where, alignment::record_of(*file_.state).patches, last);
    }
  }

  std::vector<surfaces::Inlier> take_inliers(SurfaceId id) {
    auto entry = inliers_.extract(id);
    if (entry.empty()) return {};
    std::vector<surfaces::Inlier> inliers = std::move(entry.mapped());
    std::ranges::sort(inliers,
                      [](const surfaces::Inlier& a, const surfaces::Inlier& b) { return a.key < b.key; });
    return inliers;
  }

  void read_footer() {
    require(record_.field == map_file::Record::kFooter, "records are missing, or out of order");
    const auto footer = parse<map_file::Footer>(small_record_limit);
    require(footer.has_records() && footer.records() == records_.records() - 1, "records are missing");
    require(footer.has_crc32() && footer.crc32() == records_.crc32_before_last(), "the checksum differs");
    advance();
    require(record_.field == 0, "records follow the last one");
  }

  void publish() {
    surfaces::MapState& state = *file_.state;
    auto snapshot =
        std::make_shared<Snapshot>(Snapshot{state.revision, state.parameters.occupancy.resolution, {}});
    for (const auto& [id, surface] : state.surfaces)
      snapshot->surfaces.push_back(surface.publish(surface.revision));
    snapshot->cylinders = state.cylinders.publish(state.revision);
    snapshot->removals = state.removals;
    state.snapshot.store(std::move(snapshot));
  }

  RecordReader records_;
  std::uint64_t most_memory_, memory_ = 0;
  std::string bytes_;
  RecordView record_;  // into bytes_; field 0 after the last one
  MapFile file_;
  std::unordered_map<SurfaceId, std::vector<surfaces::Inlier>> inliers_;
  std::set<std::pair<bool, std::uint32_t>> gone_;  // cylinder or not, and id
  std::uint64_t last_gone_ = 0;                    // in which revision
};

void check_version(std::istream& in, const std::string& where) {
  const Damage damage{where, {}};
  std::array<char, map_file_magic.size() + 4> head{};
  in.read(head.data(), head.size());
  const std::string_view bytes(head.data(), static_cast<std::size_t>(in.gcount()));
  if (!bytes.starts_with(map_file_magic))
    throw Error(Error::Kind::data, where, "is not an octosurf map",
                "expected a .surfaces file of octosurf map");
  damage.require(bytes.size() == head.size(), "it ends too early");
  std::uint32_t version = 0;
  for (std::size_t i = 0; i < 4; ++i)
    version |= std::uint32_t{static_cast<unsigned char>(bytes[map_file_magic.size() + i])} << (8 * i);
  damage.require(version > 0, "it has no version");
  if (version != map_file_version)
    throw Error(Error::Kind::data, where,
                "has version " + std::to_string(version) + " of the format, this octosurf reads version " +
                    std::to_string(map_file_version),
                version > map_file_version
                    ? "use the newer octosurf that wrote it"
                    : "make the map anew from its scans, or use the octosurf that wrote it");
}

}  // namespace

MapFile read_map(std::istream& in, std::uint64_t file_bytes, const std::string& where) {
  check_version(in, where);
  return MapReader(in, file_bytes, where)();
}

std::optional<FileSum> octree_sum_of(const std::filesystem::path& file) try {
  std::error_code failure;
  const std::uintmax_t bytes = std::filesystem::file_size(file, failure);
  std::ifstream in(file, std::ios::binary);
  if (failure || !in) return {};
  check_version(in, file.string());
  return MapReader(in, bytes, file.string()).octree_sum();
} catch (const Error&) {
  return {};
}

}  // namespace octosurf::io
