#include "io/readers/scan_graph.hpp"

#include "io/readers/bounded_file.hpp"

#include <string>
#include <utility>

namespace octosurf::io {
namespace {

// Layout (octomap::ScanGraph::writeBinary), in the host's byte order: uint32 scans; per scan uint32
// points, points, pose, uint32 id; uint32 edges; edges. A vector is uint32 dimension and doubles.
constexpr std::uint64_t count_bytes = 4;
constexpr std::uint64_t point_bytes = 4 + 3 * 8;
constexpr std::uint64_t pose_bytes = (4 + 3 * 8) + (4 + 4 * 8);
constexpr std::uint64_t edge_bytes = 4 + 4 + pose_bytes + 8;

constexpr const char* graph_hint = "write it again, e.g. with OctoMap's log2graph";

std::uint32_t take_count(BoundedFile& file) {
  return number_at<std::uint32_t>(file.take(count_bytes).data(), false);
}

/// Skips the dimension before the numbers.
template <int N>
Eigen::Matrix<double, N, 1> vector_at(const char* bytes) {
  return Eigen::Matrix<double, N, 1>(number_at<std::array<double, N>>(bytes + count_bytes, false).data());
}

}  // namespace

ScanGraphFile::ScanGraphFile(std::filesystem::path file) : file_(std::move(file)) {
  BoundedFile reader(file_);
  const std::uint32_t scans = take_count(reader);
  if (scans == 0) reader.refuse("a scan graph without scans", graph_hint);
  if (scans > reader.left() / (count_bytes + pose_bytes + count_bytes))
    reader.refuse("truncated scan graph", graph_hint);
  offsets_.reserve(scans);
  for (std::uint32_t i = 0; i < scans; ++i) {
    offsets_.push_back(reader.position());
    reader.skip(take_count(reader) * point_bytes + pose_bytes + count_bytes);
  }
  reader.skip(take_count(reader) * edge_bytes);
  if (reader.left() != 0) reader.refuse("not a scan graph", graph_hint);
}

bool ScanGraphFile::matches(const std::filesystem::path& file) noexcept {
  try {
    return ScanGraphFile(file).size() > 0;
  } catch (const std::exception&) {
    return false;
  }
}

Scan ScanGraphFile::read(std::size_t index) const {
  BoundedFile reader(file_);
  reader.seek(offsets_.at(index));
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.name = file_.string() + " scan " + std::to_string(index);

  const std::uint32_t points = take_count(reader);
  const std::string bytes = reader.take(points * point_bytes), pose = reader.take(pose_bytes);
  scan.points.reserve(points);
  for (std::size_t at = 0; at < bytes.size(); at += point_bytes)
    scan.points.push_back(vector_at<3>(bytes.data() + at).cast<float>());
  scan.T_map_sensor.translation() = vector_at<3>(pose.data());
  const Eigen::Vector4d wxyz = vector_at<4>(pose.data() + point_bytes);
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  // OctoMap's quaternions are unit up to rounding; others must fail the rotation check.
  scan.T_map_sensor.linear() = q.squaredNorm() * q.normalized().toRotationMatrix();
  return scan;
}

}  // namespace octosurf::io
