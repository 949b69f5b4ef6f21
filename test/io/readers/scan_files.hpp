#pragma once

#include "io/files.hpp"

#include <octosurf/scan_source.hpp>

namespace octosurf::test {

/// Writes scans into the test's folder.
class ScanFiles : public FolderTest {
 protected:
  fs::path write(const std::string& name, std::string_view content) const;
  /// 16-bit gray PNG.
  fs::path write_png(const std::string& name, int width, int height,
                     const std::vector<std::uint16_t>& pixels) const;
  /// 8-bit PNG, one channel or three.
  fs::path write_picture(const std::string& name, bool colour) const;
  /// Three points (1, 2, 3), (4, 5, 6), (nan, nan, nan).
  fs::path write_pcd(const std::string& name, const std::string& viewpoint = "0 0 0 1 0 0 0") const;
};

std::vector<Scan> read_all(ScanSource& source);
std::vector<Scan> read_all(const std::vector<fs::path>& inputs, const ScanSourceOptions& options = {});

std::vector<double> stamps(const std::vector<Scan>& scans);
std::vector<double> places(const std::vector<Scan>& scans);  ///< x of where they were taken
/// The message of the Error(data) that opening or reading throws; fails the test if there is none.
std::string failure(const std::vector<fs::path>& inputs, const ScanSourceOptions& options = {});

/// The bytes of values in memory order.
template <typename... T>
std::string bytes_of(const T&... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

inline ScanSourceOptions with_poses(const fs::path& poses) {
  ScanSourceOptions options;
  options.poses = poses;
  return options;
}

inline const char* const identity_pose = "0 0 0 0 0 0 1\n";

}  // namespace octosurf::test
