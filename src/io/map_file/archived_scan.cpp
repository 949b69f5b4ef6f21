#include "io/map_file/archived_scan.hpp"

#include "geometry/morton.hpp"
#include "io/map_file/file_beginning.hpp"
#include "io/map_file/record_stream.hpp"
#include "scan_archive.pb.h"
#include "sensing/noise_model.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;
using scan_archive::Record;

constexpr FileBeginning beginning{archived_scan_magic, archived_scan_version, "an archived scan",
                                  "octosurf map --keep-scans"};

// What a file may decompress to: five bytes a voxel and more, of which real scans leave 3.5 … 4. In memory a
// byte makes 28 at most, where all are steps: eight, twice while they grow, and a point.
constexpr Expansion scan_stream{.free = std::uint64_t{2} << 20, .ratio = 4};
constexpr std::size_t largest_header = std::size_t{64} << 10;
constexpr std::size_t longest_name = 4096;
constexpr std::uint64_t end_of_keys = std::uint64_t{1} << 48;
constexpr std::uint32_t most_in_pixel = std::numeric_limits<std::uint16_t>::max();

std::uint64_t morton_of(geometry::VoxelKey key) { return geometry::morton_of(key.x, key.y, key.z); }
geometry::VoxelKey key_of(std::uint64_t morton) {
  const auto axis = [&](int shift) {
    return static_cast<std::uint16_t>(geometry::compact_bits(morton >> shift));
  };
  return {axis(0), axis(1), axis(2)};
}

template <class Add>
void put_pose(const Eigen::Isometry3d& T, Add&& add) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) add(T(row, column));
}

class ArchiveWriter {
 public:
  ArchiveWriter(const ArchivedScan& scan, std::ostream& out) : scan_(scan), records_(out) {}

  void operator()() {
    put([&](Record& record) { fill(*record.mutable_header()); });
    put([&](Record& record) {
      std::uint64_t last = 0;
      for (const ArchivedScan::Point& p : scan_.points) {
        record.mutable_voxels()->add_steps(morton_of(p.key) - last);
        last = morton_of(p.key);
      }
      record.mutable_voxels();  // also if there is no point
    });
    put([&](Record& record) { record.set_x(column(0)); });
    put([&](Record& record) { record.set_y(column(1)); });
    put([&](Record& record) { record.set_z(column(2)); });
    put([&](Record& record) {
      for (const ArchivedScan::Point& p : scan_.points) record.mutable_readings()->add_counts(p.readings);
      record.mutable_readings();
    });
    const std::uint32_t crc32 = records_.crc32();
    put([&](Record& record) { record.mutable_footer()->set_crc32(crc32); });
    records_.finish(scan_stream.least_file(records_.bytes()));
  }

 private:
  template <class Fill>
  void put(Fill&& fill_record) {
    Record record;
    fill_record(record);
    records_.put(record.SerializeAsString());
    records_.end_block();
  }

  void fill(scan_archive::Header& header) const {
    const ArchivedHeader& h = scan_.header;
    header.set_name(h.name.substr(0, longest_name));
    header.set_stamp_s(h.stamp_s);
    if (h.sensor == SensorKind::lidar) header.set_lidar(true);
    header.set_resolution(h.resolution);
    put_pose(h.T_used, [&](double value) { header.add_pose(value); });
    if (h.T_given.matrix() != h.T_used.matrix())
      put_pose(h.T_given, [&](double value) { header.add_given_pose(value); });
    std::uint32_t last = 0;
    for (const NoiseCount& seen : h.noise) {
      const auto place = static_cast<std::uint32_t>(seen.range_class * sensing::NoiseModel::bins + seen.size);
      header.add_noise_steps(place - last);
      header.add_noise_counts(seen.count);
      last = place;
    }
    for (const SharedVariance& shared : h.shared_variances) {
      header.add_shared_classes(shared.range_class);
      header.add_shared_variances(shared.variance);
    }
  }

  std::string column(std::size_t axis) const {
    std::string bytes;
    bytes.reserve(scan_.points.size());
    for (const ArchivedScan::Point& p : scan_.points) bytes.push_back(static_cast<char>(p.place[axis]));
    return bytes;
  }

  const ArchivedScan& scan_;
  RecordWriter records_;
};

class ArchiveReader {
 public:
  explicit ArchiveReader(const fs::path& file)
      : where_(file.string()),
        in_(file, std::ios::binary),
        records_(after_beginning(in_, where_, beginning), scan_stream.most(size_of(file)), where_) {}

  ArchivedHeader header() {
    const Record record = next(Record::kHeader);
    require(record.ByteSizeLong() <= largest_header, "its header is too long");
    const scan_archive::Header& h = record.header();
    require(h.has_stamp_s() && h.has_resolution() && std::isfinite(h.stamp_s()) &&
                std::isfinite(h.resolution()) && h.resolution() > 0 && h.name().size() <= longest_name,
            "its header makes no sense");
    ArchivedHeader header;
    header.name = h.name();
    header.stamp_s = h.stamp_s();
    header.sensor = h.lidar() ? SensorKind::lidar : SensorKind::depth_camera;
    header.resolution = h.resolution();
    header.T_used = pose(h.pose());
    header.T_given = h.given_pose_size() > 0 ? pose(h.given_pose()) : header.T_used;
    require(
        header.T_used.translation().cwiseAbs().maxCoeff() <= header.resolution * geometry::VoxelGrid::origin,
        "the sensor stands outside the octree");
    header.noise = noise(h);
    header.shared_variances = shared_variances(h);
    return header;
  }

  ArchivedScan scan() {
    ArchivedScan scan;
    scan.header = header();
    read_voxels(scan.points);
    read_column(next(Record::kX).x(), 0, scan.points);
    read_column(next(Record::kY).y(), 1, scan.points);
    read_column(next(Record::kZ).z(), 2, scan.points);
    read_readings(scan.points);
    const Record footer = next(Record::kFooter);
    require(footer.footer().has_crc32() && footer.footer().crc32() == records_.crc32_before_last(),
            "the checksum differs");
    require(!records_.next(bytes_), "records follow the last one");
    return scan;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::data, where_, "is damaged: " + what, "restore it from a backup");
  }
  void require(bool holds, const char* what) const {
    if (!holds) fail(what);
  }

  static std::uint64_t size_of(const fs::path& file) {
    std::error_code failure;
    const std::uintmax_t bytes = fs::file_size(file, failure);
    return failure ? 0 : bytes;
  }

  Record next(int field) {
    Record record;
    require(records_.next(bytes_) && record.ParseFromString(bytes_) && record.content_case() == field,
            "a record is missing, or cannot be read");
    return record;
  }

  Eigen::Isometry3d pose(const google::protobuf::RepeatedField<double>& values) const {
    require(values.size() == 12, "a pose has not twelve numbers");
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (int i = 0; i < 12; ++i) T(i / 4, i % 4) = values[i];
    require_rigid(T, where_);
    return T;
  }

  std::vector<NoiseCount> noise(const scan_archive::Header& header) const {
    constexpr std::uint32_t places = sensing::NoiseModel::classes * sensing::NoiseModel::bins;
    require(header.noise_steps_size() == header.noise_counts_size(), "its noise is not complete");
    std::vector<NoiseCount> noise;
    std::uint32_t place = 0;
    for (int i = 0; i < header.noise_steps_size(); ++i) {
      const std::uint32_t step = header.noise_steps(i);
      require((step > 0 || i == 0) && step < places && place + step < places, "its noise is out of order");
      place += step;
      noise.push_back({static_cast<std::uint8_t>(place / sensing::NoiseModel::bins),
                       static_cast<std::uint8_t>(place % sensing::NoiseModel::bins), header.noise_counts(i)});
    }
    return noise;
  }

  std::vector<SharedVariance> shared_variances(const scan_archive::Header& header) const {
    require(header.shared_classes_size() == header.shared_variances_size(),
            "what its readings share is not complete");
    std::vector<SharedVariance> shared;
    for (int i = 0; i < header.shared_classes_size(); ++i) {
      require(header.shared_classes(i) < sensing::NoiseModel::classes &&
                  std::isfinite(header.shared_variances(i)),
              "what its readings share makes no sense");
      shared.push_back({static_cast<std::uint8_t>(header.shared_classes(i)), header.shared_variances(i)});
    }
    return shared;
  }

  void read_voxels(std::vector<ArchivedScan::Point>& points) {
    const Record record = next(Record::kVoxels);
    points.reserve(static_cast<std::size_t>(record.voxels().steps_size()));
    std::uint64_t last = 0;
    for (const std::uint64_t step : record.voxels().steps()) {
      require((step > 0 || points.empty()) && step < end_of_keys && last + step < end_of_keys,
              "a voxel lies outside the octree, or out of order");
      last += step;
      points.push_back({key_of(last), {}, 1});
    }
  }

  void read_column(const std::string& column, std::size_t axis,
                   std::vector<ArchivedScan::Point>& points) const {
    require(column.size() == points.size(), "columns are not of one length");
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i].place[axis] = static_cast<std::uint8_t>(column[i]);
  }

  void read_readings(std::vector<ArchivedScan::Point>& points) {
    const Record record = next(Record::kReadings);
    const auto& counts = record.readings().counts();
    require(static_cast<std::size_t>(counts.size()) == points.size(), "columns are not of one length");
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t count = counts[static_cast<int>(i)];
      require(count >= 1 && count <= most_in_pixel, "a number of readings makes no sense");
      points[i].readings = static_cast<std::uint16_t>(count);
      sum += count;
    }
    require(sum <= std::numeric_limits<std::uint32_t>::max(), "it has too many readings");
  }

  std::string where_;
  std::ifstream in_;
  RecordReader records_;
  std::string bytes_;
};

}  // namespace

Scan ArchivedScan::scan() const {
  Scan scan;
  scan.T_map_sensor = header.T_used;
  scan.stamp_s = header.stamp_s;
  scan.sensor = header.sensor;
  scan.name = header.name;
  scan.noise = header.noise;
  scan.shared_variances = header.shared_variances;
  const geometry::VoxelGrid grid(header.resolution);
  const Eigen::Isometry3d T_sensor_map = header.T_used.inverse();
  scan.points.reserve(points.size());
  scan.readings.reserve(points.size());
  for (const Point& p : points) {
    scan.points.push_back(
        (T_sensor_map * sensing::point_at(grid, p.key, p.place).cast<double>()).cast<float>());
    scan.readings.push_back(p.readings);
  }
  return scan;
}

ArchivedScan archived(ArchivedHeader header, const sensing::VoxelScan& voxels) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(voxels.ends.size());
  for (const sensing::EndVoxel& end : voxels.ends)
    order.emplace_back(morton_of(end.key), static_cast<std::uint32_t>(order.size()));
  std::sort(order.begin(), order.end());
  ArchivedScan scan{std::move(header), {}};
  scan.points.reserve(order.size());
  const geometry::VoxelGrid grid(scan.header.resolution);
  for (const auto& [morton, i] : order) {
    const sensing::EndVoxel& end = voxels.ends[i];
    scan.points.push_back({end.key, sensing::place_in_voxel(grid, end.key, end.centroid),
                           static_cast<std::uint16_t>(std::min(end.count, most_in_pixel))});
  }
  return scan;
}

void write_archived_scan(const ArchivedScan& scan, std::ostream& out) {
  out.write(archived_scan_magic.data(), archived_scan_magic.size());
  for (int shift = 0; shift < 32; shift += 8)
    out.put(static_cast<char>(archived_scan_version >> shift & 0xff));
  ArchiveWriter(scan, out)();
}

ArchivedScan read_archived_scan(const fs::path& file) { return ArchiveReader(file).scan(); }
ArchivedHeader read_archived_header(const fs::path& file) { return ArchiveReader(file).header(); }

}  // namespace octosurf::io
