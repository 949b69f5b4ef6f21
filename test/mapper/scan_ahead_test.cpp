// What is done of the next scan while surfaces are brought up to date: it saves time and changes nothing.
#include "mapper/scan_ahead.hpp"

#include "support/guarantees.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <new>
#include <random>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::mapper {
namespace {

Scan some_scan() {
  Scan scan;
  scan.points = {{1, 2, 3}, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN())};
  return scan;
}

TracedScan traced(const Scan& scan) {
  TracedScan traced;
  traced.voxels.not_finite = scan.points.size();
  return traced;
}

/// Whether what was done for `expected` is taken for `inserted`.
bool taken(const Scan& expected, const Scan& inserted) {
  ScanAhead ahead;
  ahead.start(expected, traced);
  ahead.wait();
  return ahead.take(inserted).has_value();
}

TEST(ScanAhead, IsOfJustTheScanItWasStartedFor) {
  const Scan scan = some_scan();
  EXPECT_TRUE(taken(scan, Scan(scan)));
  const auto taken_if = [&](const std::function<void(Scan&)>& change) {
    Scan other = scan;
    change(other);
    return taken(scan, other);
  };
  EXPECT_TRUE(taken_if([](Scan& s) { s.stamp_s = 7; })) << "no ray depends on it";
  EXPECT_FALSE(taken_if([](Scan& s) { s.points[0].x() += 1e-6F; }));
  EXPECT_FALSE(taken_if([](Scan& s) { s.points.pop_back(); }));
  EXPECT_FALSE(taken_if([](Scan& s) { s.T_map_sensor.translation().x() = 1e-9; }));
  EXPECT_FALSE(taken_if([](Scan& s) { s.sensor = SensorKind::lidar; }));
}

TEST(ScanAhead, IsOfTheScanAsItWas) {
  Scan scan = some_scan();
  ScanAhead ahead;
  ahead.start(scan, traced);
  ahead.wait();
  scan.points[0].z() = 4;
  EXPECT_FALSE(ahead.take(scan));
}

TEST(ScanAhead, IsTakenOnce) {
  const Scan scan = some_scan();
  ScanAhead ahead;
  ahead.start(scan, traced);
  ahead.wait();
  EXPECT_EQ(ahead.take(scan).value().voxels.not_finite, 2U);
  EXPECT_FALSE(ahead.take(scan));
}

TEST(ScanAhead, WhatFailsIsNotThere) {
  const Scan scan = some_scan();
  ScanAhead ahead;
  ahead.start(scan, traced);
  ahead.start(scan, [](const Scan&) -> TracedScan { throw std::bad_alloc(); });
  ahead.wait();
  EXPECT_FALSE(ahead.take(scan));
}

/// A camera that walks past a box.
std::vector<Scan> recording(std::mt19937_64& rng, int count) {
  const test::Scene scene =
      test::Scene().box({-1.5, -1.2, 0.01}, {1.5, 1.2, 2.0}).box({0.3, -0.4, 0.01}, {0.9, 0.3, 0.4});
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d eye(-1.2 + 0.05 * i, 0.9 - 0.06 * i, 1.3);
    scans.push_back(test::camera_scan(scene, test::look_at(eye, {0.5, 0.0, 0.1}), rng));
  }
  return scans;
}

TEST(InsertAll, AnExpectedScanIsRefusedWhenItComes) {
  std::mt19937_64 rng = test::rng();
  std::vector<Scan> scans = recording(rng, 3);
  Mapper mapper(Parameters(), 2), alone;
  scans[1].T_map_sensor.linear() *= 2;
  EXPECT_NO_THROW(mapper.insert_all({&scans[0], 1}, [&] { return &scans[1]; }));
  EXPECT_THROW(mapper.insert(scans[1]), Error);
  mapper.insert(scans[2]);
  alone.insert(scans[0]);
  alone.insert(scans[2]);
  EXPECT_TRUE(test::digest(mapper.map()) == test::digest(alone.map()));
}

TEST(InsertAll, TheTimeOfWhatWasDoneAheadIsInItsReport) {
  std::mt19937_64 rng = test::rng();
  const std::vector<Scan> scans = recording(rng, 2);
  Mapper mapper(Parameters(), 2);
  mapper.insert_all({&scans[0], 1}, [&] { return &scans[1]; });
  const ScanReport report = mapper.insert(scans[1]);
  EXPECT_GT(report.stage_ms[static_cast<std::size_t>(Stage::downsample)], 0);
  EXPECT_GT(report.stage_ms[static_cast<std::size_t>(Stage::occupancy)], 0);
  EXPECT_GT(report.voxels, 0U);
}

}  // namespace
}  // namespace octosurf::mapper
