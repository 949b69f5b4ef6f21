#include "io/map_file/map_file.hpp"
#include "io/map_file/record_numbers.hpp"
#include "io/map_file/records.hpp"
#include "io/text_file.hpp"
#include "map_file.pb.h"
#include "surfaces/succession.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::size_t longest_path = 4096;
constexpr double largest_integer = 1e9;  // limit of a parameter; real ones are far below

class MapReader : Damage {
 public:
  explicit MapReader(const std::filesystem::path& file)
      : Damage{file.string(), {}}, rows_(file), most_memory_(map_memory.most(rows_.file_bytes())) {}

  MapFile operator()() {
    const map_file::Files sums = read_state();
    read_octree();
    read_queue();
    read_held();
    read_surfaces();
    read_cylinders();
    read_removals();
    read_seen_patches();
    read_kept_scans();
    const RowSums::Total total = rows_.sums().total();
    require(sums.rows() == total.count && sums.digest() == total.digest, "rows are missing");
    surfaces::publish_whole(*file_.state);
    saved_of(*file_.state).rows = rows_.sums();
    return std::move(file_);
  }
  MapFiles files() {
    rows_.for_each(Table::state, [&](std::int64_t key, std::string& content) {
      if (key == files_key) read_files(content);
    });
    file_.files.sum = rows_.sums().files_sum();
    return std::move(file_.files);
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

  template <class Message>
  Message parse(const std::string& content) const {
    Message message;
    require(message.ParseFromString(content), "a row cannot be read");
    return message;
  }
  template <class Message, class Visit>
  void for_each(Table table, const Visit& visit) {
    rows_.for_each(table, [&](std::int64_t key, std::string& content) {
      check_memory(content.size());
      Message message = parse<Message>(content);
      visit(key, message);
    });
  }

  map_file::Files read_state() {
    map_file::Files files;
    bool begun = false;
    rows_.for_each(Table::state, [&](std::int64_t key, std::string& content) {
      require(key == (begun ? files_key : header_key), "its state is not as this format has it");
      if (std::exchange(begun, true))
        files = read_files(content);
      else
        read_header(parse<map_file::Header>(content));
    });
    require(begun && files.has_rows() && files.has_digest(), "it has no state");
    return files;
  }

  map_file::Files read_files(const std::string& content) {
    auto files = parse<map_file::Files>(content);
    MapFiles& read = file_.files;
    require(files.bt_bytes_size() == files.bt_crc32_size() && files.bt_bytes_size() <= 2,
            "its .bt makes no sense");
    for (int i = 0; i < files.bt_bytes_size(); ++i) read.bt.push_back({files.bt_bytes(i), files.bt_crc32(i)});
    read.bt_revision = files.bt_revision();
    require(files.kept_scans().size() <= longest_path && files.kept_scans().find('\0') == std::string::npos,
            "the name of the scans' folder makes no sense");
    read.scans.folder = files.kept_scans();
    read.scans.shared = files.kept_scans_shared();
    return files;
  }

  void read_header(map_file::Header header) {
    file_.state = std::make_unique<surfaces::MapState>(read_parameters(header));
    surfaces::MapState& state = *file_.state;
    require(header.has_revision() && header.has_scans() && header.has_points() && header.has_next_id() &&
                header.has_range_noise(),
            "the header is not complete");
    state.revision = header.revision();
    state.scans = header.scans();
    state.points = header.points();
    require(state.revision < largest_count && state.scans < largest_count, "its counts make no sense");
    require(header.next_id() >= 1 && header.next_id() <= last_id + 1, "there is no such next surface id");
    state.surfaces.set_next_id(header.next_id());
    if (header.has_next_cylinder_id()) {
      require(header.next_cylinder_id() >= 1 && header.next_cylinder_id() <= last_id + 1,
              "there is no such next cylinder id");
      state.cylinders.set_next_id(header.next_cylinder_id());
    }
    require(header.removals_left_out() < largest_count && header.removals_left_out() % values_per_row == 0 &&
                header.removals_complete_since() <= state.revision,
            "its counts of earlier removals make no sense");
    state.removals = RemovalLog(header.removals_left_out(), header.removals_complete_since());
    state.sensors_up = vector_of(header.sensors_up(), static_cast<double>(header.scans()) * (1 + 1e-3),
                                 "the sensors' up direction makes no sense");
    if (header.origin_size() > 0)
      state.origin =
          vector_of(header.origin(), std::numeric_limits<double>::max(), "the origin makes no sense");
    if (header.has_alignment())
      alignment::record_of(state).state = read_alignment(*header.mutable_alignment(), where);
    read_noise(header);
  }

  /// Reports an invalid parameter as damage of the file.
  Parameters read_parameters(const map_file::Header& header) const try {
    Parameters parameters;
    const auto& infos = parameter_infos();
    for (const map_file::Parameter& p : header.parameters()) {
      const bool known =
          std::ranges::any_of(infos, [&](const ParameterInfo& info) { return info.name == p.name(); });
      if (!known)
        throw Error(
            Error::Kind::data, where,
            "has a parameter '" + printable(p.name().substr(0, 64)) + "' that this octosurf does not know",
            "use the newer version that wrote it");
      require(!p.has_value() || std::fabs(p.value()) <= largest_integer, "a parameter makes no sense");
      set_parameter_value(parameters, p.name(), p.has_value() ? std::optional(p.value()) : std::nullopt);
    }
    parameters.validate();
    return parameters;
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::usage) throw;
    fail(error.what());
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
    rows_.for_each(Table::octree, [&](std::int64_t path, std::string& nodes) {
      state.occupancy.read_part(static_cast<std::uint64_t>(path), std::move(nodes), where);
      check_memory(state.occupancy.bytes());
    });
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

  void read_queue() {
    surfaces::PendingQueue& queue = file_.state->queue;
    for_each<map_file::Accumulated>(
        Table::waiting, [&](std::int64_t at, const map_file::Accumulated& record) {
          charge(static_cast<std::uint64_t>(record.steps_size() + record.blocks_size()), waiting_cost);
          require((at < first_blocks ? record.blocks() : record.steps()).empty(),
                  "waiting points follow waiting blocks");
          KeySteps steps;
          for (const std::uint64_t step : record.steps()) {
            const auto key = steps.from(step);
            if (!key || cube_of(*key) != at) fail("a waiting point lies outside the octree, or out of order");
            queue.fresh.push_back(*key);
          }
          for (const std::uint64_t block : record.blocks()) {
            require(block < std::uint64_t{1} << 48, "a waiting block lies outside the octree");
            queue.blocks.push_back(geometry::VoxelKey::unpack(block));
          }
        });
    std::sort(queue.fresh.begin(), queue.fresh.end());
  }

  void read_held() {
    std::vector<std::uint64_t>& held = file_.state->held;
    for_each<map_file::Held>(Table::held, [&](std::int64_t, const map_file::Held& record) {
      const auto more = static_cast<std::size_t>(record.scans_size());
      require(more <= file_.state->scans - held.size(), "it holds scans that are not there");
      charge(more, held_cost);
      held.insert(held.end(), record.scans().begin(), record.scans().end());
    });
  }

  void read_kept_scans() {
    std::vector<Eigen::Isometry3d>& poses = file_.files.scans.poses;
    std::vector<std::uint32_t>& marks = file_.files.scans.marks;
    for_each<map_file::ScanPoses>(Table::kept_scans, [&](std::int64_t, map_file::ScanPoses& record) {
      const auto count = static_cast<std::size_t>(record.values_size()) / 12;
      require(count <= file_.state->scans - poses.size(), "it has poses of scans that are not there");
      charge(count, pose_cost);
      charge(static_cast<std::size_t>(record.marks_size()), held_cost);
      marks.insert(marks.end(), record.marks().begin(), record.marks().end());
      for (RecordNumbers<double> values(*record.mutable_values(), this, finite_numbers); !values.at_end();) {
        values(poses.emplace_back(Eigen::Isometry3d::Identity()));
        require_rigid(poses.back(), where);
      }
    });
    require(file_.files.scans.folder.empty() || poses.size() == file_.state->scans,
            "poses of its scans are missing");
    require(marks.empty() || marks.size() == poses.size(), "marks of its scans are missing");
  }

  void read_surfaces() {
    surfaces::MapState& state = *file_.state;
    const SurfaceLimits limits{state.parameters, state.revision, state.surfaces.next_id()};
    for_each<map_file::Surface>(Table::surfaces, [&](std::int64_t id, map_file::Surface& record) {
      const auto vertices = static_cast<std::uint64_t>(record.polygons().uv_size()) / 2;
      const auto rings = static_cast<std::uint64_t>(record.polygons().vertices_size());
      charge(1, surface_cost + sizeof(SurfaceId) * static_cast<std::uint64_t>(record.parents_size()));
      charge(vertices + rings, vertex_cost);
      check_memory(vertices * check_cost);
      require(std::cmp_equal(record.id(), id) && id > 0 && record.id() < limits.next_id,
              "a surface's id is out of order, or not given out yet");
      require(occupancy::SurfaceNumbers::of(record.id()) != 0 && !state.surfaces.has_number_of(record.id()),
              "a surface's id is like another's in its low 24 bits");
      state.occupancy.add_surface(record.id());
      surfaces::SurfaceModel::State surface = read_surface(record, limits, where);
      surface.inliers = take_inliers(surface.id);
      require_inliers(surface, record.inliers(), where);
      state.surfaces.restore(surface);
    });
    if (!inliers_.empty()) fail("voxels belong to a surface that is not there");
  }

  void read_cylinders() {
    surfaces::MapState& state = *file_.state;
    for_each<map_file::Cylinder>(Table::cylinders, [&](std::int64_t id, map_file::Cylinder& record) {
      charge(static_cast<std::uint64_t>(record.steps_size()), inlier_cost);
      require(state.parameters.detection.detect_cylinders, "it has cylinders but is not to have any");
      require(std::cmp_equal(record.id(), id) && id > 0 && record.id() < state.cylinders.next_id(),
              "a cylinder's id is out of order, or not given out yet");
      state.cylinders.restore(read_cylinder(record, state, where));
    });
  }

  void read_removals() {
    for_each<map_file::Removals>(Table::removals, [&](std::int64_t, const map_file::Removals& record) {
      std::vector<Removal> removals;
      for (const map_file::Removal& removal : record.removals()) {
        charge(1, removal_cost + sizeof(SurfaceId) * static_cast<std::uint64_t>(removal.parents_size()));
        removals.push_back(read_removal(removal));
      }
      file_.state->removals = file_.state->removals.with(removals);
    });
  }

  /// Checks that the id was assigned, has gone, and departs once and in order.
  Removal read_removal(const map_file::Removal& record) {
    const surfaces::MapState& state = *file_.state;
    const bool cylinder = record.cylinder();
    const std::uint64_t id = record.id(),
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
    alignment::SeenPatches& patches = alignment::record_of(*file_.state).patches;
    for_each<map_file::SeenPatches>(
        Table::seen_patches, [&](std::int64_t block, map_file::SeenPatches& record) {
          charge(static_cast<std::uint64_t>(record.keys_size()), patch_cost);
          read_patches(record, static_cast<alignment::SeenPatches::Key>(block), where, patches);
        });
    patches.take_changed_blocks();
  }

  std::vector<surfaces::Inlier> take_inliers(SurfaceId id) {
    auto entry = inliers_.extract(occupancy::SurfaceNumbers::of(id));
    if (entry.empty()) return {};
    std::vector<surfaces::Inlier> inliers = std::move(entry.mapped());
    std::ranges::sort(inliers,
                      [](const surfaces::Inlier& a, const surfaces::Inlier& b) { return a.key < b.key; });
    return inliers;
  }

  RowReader rows_;
  std::uint64_t most_memory_, memory_ = 0;
  MapFile file_;
  std::unordered_map<SurfaceId, std::vector<surfaces::Inlier>> inliers_;  // by number
  std::set<std::pair<bool, std::uint64_t>> gone_;                         // cylinder or not, and id
  std::uint64_t last_gone_ = 0;                                           // in which revision
};

}  // namespace

MapFile read_map(const std::filesystem::path& file) { return MapReader(file)(); }

MapFiles files_of(const std::filesystem::path& file) try {
  return MapReader(file).files();
} catch (const Error&) {
  return {};
}

}  // namespace octosurf::io
