#pragma once

#include "support/testing.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::test {

/// A mapper whose reports are checked after every scan, and its invariants after scans 1, 2, 4, 8 … and the
/// last: a check costs as much as a scan or more, and what breaks one is still there later. The contract
/// checks after every scan.
class CheckedMapper {
 public:
  explicit CheckedMapper(const Parameters& parameters = {}, const detection::Detector* paper = nullptr)
      : mapper(parameters, 1, paper) {}
  CheckedMapper(const CheckedMapper&) = delete;
  CheckedMapper& operator=(const CheckedMapper&) = delete;
  ~CheckedMapper();

  ScanReport insert(const Scan& scan);

  std::vector<SurfacePtr> surfaces() const { return mapper.snapshot()->surfaces; }

  /// Surfaces near a plane: normals within 5°, `point` within 2 cm of the surface's plane.
  std::vector<SurfacePtr> on_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& point) const;

  Mapper mapper;

 private:
  static void expect_told(const Snapshot& before, const Snapshot& after, const ScanReport& report);
};

inline Mapper mapped(const std::vector<Scan>& scans, const Parameters& parameters = {}, int threads = 1) {
  Mapper mapper(parameters, threads);
  for (const Scan& scan : scans) mapper.insert(scan);
  return mapper;
}

}  // namespace octosurf::test
