#pragma once

#include "io/readers/recorded_scan.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace octosurf::io {

/// The scans of all inputs in one order, each with its pose, time stamp and kind of sensor; read on demand.
class Recording {
 public:
  /// Lists the scans, chooses what the options leave open (notes()), and reads the first of each sensor. Same
  /// errors as open_scans().
  Recording(const std::vector<std::filesystem::path>& inputs, const ScanSourceOptions& options);

  std::size_t size() const { return scans_.size(); }
  /// In the map's frame. Throws Error(data) if the scan or its pose is bad. No-return values are found in the
  /// scans read so far: read them in order.
  Scan read(std::size_t i);

  /// A line for each scan without a pose at its time.
  const std::vector<std::string>& left_out() const { return list_.left_out; }
  std::vector<std::string> notes() const;
  bool posed_elsewhere() const;
  const Eigen::Vector3d& origin() const { return origin_; }

 private:
  struct Place {
    std::size_t recording, scan;
    double stamp_s;
  };
  void choose_origin();
  void meet_sensors();
  void stamp_all();
  Scan read(std::size_t r, const ListedScan& listed);

  ScanSourceOptions options_;
  ScanList list_;
  ReadingRules rules_;
  std::vector<Motions> motions_;                             // of each recording
  std::vector<std::optional<std::pair<int, int>>> size_of_;  // of each recording's images
  std::vector<Place> scans_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  bool own_noted_ = false;
};

}  // namespace octosurf::io
