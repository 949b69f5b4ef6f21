#include "io/kept_scans.hpp"

#include "io/map_file/map_file.hpp"
#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <fstream>
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

/// Of header and first five thousand points: noise makes a few unique, and reading all would take minutes.
std::uint32_t mark_of(const fs::path& file) {
  std::array<char, 65536> begin;
  std::ifstream in(file, std::ios::binary);
  in.read(begin.data(), begin.size());
  return crc32_of({begin.data(), static_cast<std::size_t>(in.gcount())});
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

std::vector<fs::path> kept_scans(const fs::path& folder, std::uint64_t scans,
                                 std::span<const std::uint32_t> marks) {
  std::vector<fs::path> files = files_in(folder);
  if (files.size() < scans)
    throw Error(Error::Kind::data, folder.string(),
                "holds " + std::to_string(files.size()) + " of the map's " + count_of(scans, "scan"),
                "name the map's own folder of scans, or copy them there");
  files.resize(scans);
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (mark_of(files[i]) != marks[i])
      throw Error(Error::Kind::data, files[i].string(), "is not the scan that the map was built from",
                  "name the map's own folder of scans, or a copy of it");
  return files;
}

void require_room_for_scans(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored) || (fs::is_directory(folder, ignored) && fs::is_empty(folder, ignored)))
    return;
  throw Error(Error::Kind::usage, folder.string(), "is not an empty folder", "name a new one for the scans");
}

ScanWriter::ScanWriter(fs::path folder, std::uint64_t scans, std::vector<std::uint32_t> marks)
    : folder_(std::move(folder)), marks_(std::move(marks)) {
  const std::vector<fs::path> own = kept_scans(folder_, scans, marks_);
  for (std::size_t i = marks_.size(); i < own.size(); ++i) marks_.push_back(mark_of(own[i]));
  std::error_code failure;
  fs::create_directories(folder_, failure);
  if (failure) fail_to_write(folder_, "cannot be made", failure.value());
  later_ = files_in(folder_);
  later_.erase(later_.begin(), later_.begin() + static_cast<std::ptrdiff_t>(own.size()));
}

std::string ScanWriter::add(const Scan& scan) {
  const fs::path file = folder_ / file_of(scan, marks_.size());
  NewFile next(file, true);
  next.write([&](std::ostream& stream) { write_pcd(scan, stream); });
  std::string warning;
  if (!later_.empty() && later_.front() == file && sum_of(file) == sum_of(next.temporary()))
    later_.erase(later_.begin());
  else if (!later_.empty())
    warning = folder_.string() + ": has scans of another run or map, which are kept in " + set_aside_later();
  next.commit();
  marks_.push_back(mark_of(file));
  return warning;
}

std::string ScanWriter::set_aside_later() {
  std::error_code failure;
  fs::path aside = folder_ / "aside";
  for (int n = 2; !fs::create_directory(aside, failure) && !failure; ++n)
    aside = folder_ / ("aside-" + std::to_string(n));
  for (const fs::path& file : std::exchange(later_, {}))
    if (!failure) fs::rename(file, aside / file.filename(), failure);
  if (failure) fail_to_write(aside, "cannot be written", failure.value());
  sync(aside);
  return aside;
}

void ScanWriter::finish() { sync(folder_); }

}  // namespace octosurf::io
