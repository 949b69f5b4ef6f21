#include "io/kept_scans.hpp"

#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little && sizeof(Eigen::Vector3f) == 12,
              "points are written as they lie in memory");

std::string numbered(std::uint64_t number) {
  return formatted("%06llu_", static_cast<unsigned long long>(number));
}

fs::path file_of(const Scan& scan, std::uint64_t number) {
  const std::string stamp = digits_of(scan.stamp_s, std::chars_format::fixed);
  return numbered(number) + stamp + (stamp.find('.') == std::string::npos ? ".0.pcd" : ".pcd");
}

/// Nothing if the file is not a kept scan's.
std::optional<std::uint64_t> number_of(const fs::path& file) {
  const std::string name = file.filename().string();
  std::uint64_t number = 0;
  if (file.extension() != ".pcd" || !stamp_in_name(file) ||
      std::from_chars(name.data(), name.data() + name.size(), number).ec != std::errc() ||
      !name.starts_with(numbered(number)))
    return std::nullopt;
  return number;
}

/// The kept scans in `folder`, by number; none if there is no folder.
std::multimap<std::uint64_t, fs::path> files_in(const fs::path& folder) {
  std::multimap<std::uint64_t, fs::path> files;
  std::error_code failure;
  fs::directory_iterator entry(folder, failure);
  for (; !failure && entry != fs::directory_iterator(); entry.increment(failure))
    if (const auto number = number_of(entry->path())) files.emplace(*number, entry->path());
  if (failure && failure != std::errc::no_such_file_or_directory)
    throw Error(Error::Kind::data, folder.string(), "cannot be read: " + failure.message(),
                "check its rights");
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
  const std::multimap<std::uint64_t, fs::path> found = files_in(folder);
  std::vector<fs::path> files;
  for (std::uint64_t i = 0; i < scans; ++i) {
    const auto at = found.find(i);
    if (at == found.end())
      throw Error(
          Error::Kind::data, (folder / (numbered(i) + "*.pcd")).string(),
          "is missing: the map has " + std::to_string(scans) + " scans, and the folder not all of them",
          "name the map's own folder of scans, or copy them there");
    files.push_back(at->second);
  }
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
  remove_left_overs(folder_);  // of killed runs, as are later scans
  for (const auto& [number, file] : files_in(folder_)) {
    if (number >= scans) fs::remove(file, failure);
    if (failure) fail_to_write(file, "cannot be replaced", failure.value());
  }
}

ScanWriter::~ScanWriter() {
  if (writing_.valid()) writing_.wait();
}

void ScanWriter::add(Scan scan) {
  if (writing_.valid()) writing_.get();
  const fs::path file = folder_ / file_of(scan, next_++);
  const auto write = [file, kept = std::make_shared<const Scan>(std::move(scan))] {
    NewFile out(file, true, NewFile::LeftOvers::leave);
    out.write([&](std::ostream& stream) { write_pcd(*kept, stream); });
    out.commit();
  };
  try {
    writing_ = std::async(std::launch::async, write);
  } catch (const std::system_error&) {  // no thread to be had: written when it is waited for
    writing_ = std::async(std::launch::deferred, write);
  }
}

void ScanWriter::finish() {
  if (!writing_.valid()) return;
  writing_.get();
  sync_folder(folder_ / "any");
}

}  // namespace octosurf::io
