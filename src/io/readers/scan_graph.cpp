#include "io/readers/scan_graph.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

// Layout (octomap::ScanGraph::writeBinary), in the host's byte order: uint32 scans; per scan uint32
// points, points, pose, uint32 id; uint32 edges; edges. A vector is uint32 dimension and doubles.
constexpr std::uint64_t count_bytes = 4;
constexpr std::uint64_t point_bytes = 4 + 3 * 8;
constexpr std::uint64_t pose_bytes = (4 + 3 * 8) + (4 + 4 * 8);
constexpr std::uint64_t edge_bytes = 4 + 4 + pose_bytes + 8;

[[noreturn]] void refuse_graph(const std::filesystem::path& file, const std::string& what) {
  throw Error(Error::Kind::data, file.string(), what, "write it again, e.g. with OctoMap's log2graph");
}

class GraphReader {
 public:
  explicit GraphReader(const std::filesystem::path& file) : file_(file), stream_(file, std::ios::binary) {
    std::error_code error;
    bytes_ = std::filesystem::file_size(file, error);
    if (error || !stream_) refuse_graph(file, "cannot be read");
  }

  std::uint64_t left() const { return bytes_ - position_; }

  void seek(std::uint64_t position) {
    position_ = position;
    stream_.seekg(static_cast<std::streamoff>(position));
  }

  void skip(std::uint64_t bytes) {
    if (bytes > left()) refuse_graph(file_, "truncated scan graph");
    seek(position_ + bytes);
  }

  void read(void* into, std::uint64_t bytes) {
    if (bytes > left() || !stream_.read(static_cast<char*>(into), static_cast<std::streamsize>(bytes)))
      refuse_graph(file_, "truncated scan graph");
    position_ += bytes;
  }

  std::uint32_t count() {
    std::uint32_t value = 0;
    read(&value, sizeof value);
    return value;
  }

  std::uint64_t position() const { return position_; }

 private:
  const std::filesystem::path& file_;
  std::ifstream stream_;
  std::uint64_t bytes_ = 0;
  std::uint64_t position_ = 0;
};

template <std::size_t N>
std::array<double, N> vector_at(const char* bytes) {
  std::array<double, N> values;
  std::memcpy(values.data(), bytes + count_bytes, sizeof values);  // after the dimension
  return values;
}

}  // namespace

ScanGraphFile::ScanGraphFile(std::filesystem::path file) : file_(std::move(file)) {
  GraphReader reader(file_);
  const std::uint32_t scans = reader.count();
  if (scans == 0) refuse_graph(file_, "a scan graph without scans");
  if (scans > reader.left() / (count_bytes + pose_bytes + count_bytes))
    refuse_graph(file_, "truncated scan graph");
  offsets_.reserve(scans);
  for (std::uint32_t i = 0; i < scans; ++i) {
    offsets_.push_back(reader.position());
    reader.skip(reader.count() * point_bytes + pose_bytes + count_bytes);
  }
  reader.skip(reader.count() * edge_bytes);
  if (reader.left() != 0) refuse_graph(file_, "not a scan graph");
}

bool ScanGraphFile::matches(const std::filesystem::path& file) noexcept {
  try {
    return ScanGraphFile(file).size() > 0;
  } catch (const std::exception&) {
    return false;
  }
}

Scan ScanGraphFile::read(std::size_t index) const {
  GraphReader reader(file_);
  reader.seek(offsets_.at(index));
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.name = file_.string() + " scan " + std::to_string(index);

  const std::uint32_t points = reader.count();
  if (points > reader.left() / point_bytes) refuse_graph(file_, "truncated scan graph");
  std::vector<char> buffer(points * point_bytes);
  reader.read(buffer.data(), buffer.size());
  scan.points.reserve(points);
  for (std::size_t at = 0; at < buffer.size(); at += point_bytes)
    scan.points.push_back(Eigen::Vector3d(vector_at<3>(buffer.data() + at).data()).cast<float>());

  std::array<char, pose_bytes> pose;
  reader.read(pose.data(), pose.size());
  const auto translation = vector_at<3>(pose.data());
  const auto [w, x, y, z] = vector_at<4>(pose.data() + point_bytes);
  const Eigen::Quaterniond q(w, x, y, z);
  scan.T_map_sensor.translation() = Eigen::Vector3d(translation.data());
  // OctoMap's quaternions are unit up to rounding; others must fail the rotation check.
  scan.T_map_sensor.linear() = q.squaredNorm() * q.normalized().toRotationMatrix();
  return scan;
}

}  // namespace octosurf::io
