#include "io/kept_scans.hpp"

#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little && sizeof(Eigen::Vector3f) == 12,
              "points are written as they lie in memory");

fs::path file_of(const Scan& scan, std::uint64_t number) {
  const std::string stamp = digits_of(scan.stamp_s, std::chars_format::fixed);
  return formatted("%06llu_", static_cast<unsigned long long>(number)) + stamp +
         (stamp.find('.') == std::string::npos ? ".0.pcd" : ".pcd");
}

/// The clouds in `folder`, in order; none if there is no folder.
std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failure;
  fs::directory_iterator entry(folder, failure);
  for (; !failure && entry != fs::directory_iterator(); entry.increment(failure))
    if (entry->path().extension() == ".pcd") files.push_back(entry->path());
  if (failure && failure != std::errc::no_such_file_or_directory)
    throw Error(Error::Kind::data, folder.string(), "cannot be read: " + failure.message(),
                "check its rights");
  std::ranges::sort(files, natural_less, [](const fs::path& file) { return file.filename().string(); });
  return files;
}

/// Pads with NaN to the number of points at which readers recognise the sensor.
void write_pcd(const Scan& scan, std::ostream& out) {
  const bool camera = scan.sensor == SensorKind::depth_camera;
  const std::size_t size = std::max<std::size_t>(scan.points.size(), camera ? 2 : 1);
  const std::string count = std::to_string(size);
  out << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH "
      << (camera ? "1\nHEIGHT " + count : count + "\nHEIGHT 1") << "\nVIEWPOINT";
  const Eigen::Quaterniond q(scan.T_map_sensor.linear());
  const Eigen::Vector3d t = scan.T_map_sensor.translation();
  for (const double value : {t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z()}) out << ' ' << digits_of(value);
  out << "\nPOINTS " << count << "\nDATA binary\n";
  const auto write = [&](const std::vector<Eigen::Vector3f>& points) {
    out.write(reinterpret_cast<const char*>(points.data()), static_cast<std::streamsize>(12 * points.size()));
  };
  write(scan.points);
  write({size - scan.points.size(), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN())});
}

}  // namespace

std::vector<fs::path> kept_scans(const fs::path& folder, std::uint64_t scans) {
  std::vector<fs::path> files = files_in(folder);
  if (files.size() < scans)
    throw Error(Error::Kind::data, folder.string(),
                "holds " + std::to_string(files.size()) + " of the map's " + count_of(scans, "scan"),
                "name the map's own folder of scans, or copy them there");
  files.resize(scans);
  return files;
}

void require_room_for_scans(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored) || (fs::is_directory(folder, ignored) && fs::is_empty(folder, ignored)))
    return;
  throw Error(Error::Kind::usage, folder.string(), "is not an empty folder", "name a new one for the scans");
}

ScanWriter::ScanWriter(fs::path folder, std::uint64_t scans) : folder_(std::move(folder)), next_(scans) {
  kept_scans(folder_, scans);
  std::error_code failure;
  fs::create_directories(folder_, failure);
  if (failure) fail_to_write(folder_, "cannot be made", failure.value());
  const std::vector<fs::path> files = files_in(folder_);
  for (std::size_t i = scans; i < files.size(); ++i)  // of a killed run
    if (!fs::remove(files[i], failure)) fail_to_write(files[i], "cannot be replaced", failure.value());
}

void ScanWriter::add(const Scan& scan) {
  write_file(folder_ / file_of(scan, next_++), true, [&](std::ostream& stream) { write_pcd(scan, stream); });
}

void ScanWriter::finish() { sync(folder_); }

}  // namespace octosurf::io
