// What is done of the next scan while surfaces are brought up to date: it saves time and changes nothing.
#include "mapper/scan_ahead.hpp"

#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <new>
#include <random>
#include <span>
#include <string>
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
  EXPECT_FALSE(taken_if([](Scan& s) { s.readings = {1, 1}; }));
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

/// The map of the scans in groups of one to three, each time with what `expected` says of the scan after
/// them.
std::string mapped(const std::vector<Scan>& scans, int threads, std::uint64_t seed,
                   const std::function<const Scan*(std::size_t)>& expected) {
  std::mt19937_64 rng(seed);
  Mapper mapper(Parameters(), threads);
  for (std::size_t done = 0; done < scans.size();) {
    const std::size_t count = std::min<std::size_t>(1 + rng() % 3, scans.size() - done);
    const auto reports =
        mapper.insert_all(std::span(scans).subspan(done, count), [&] { return expected(done + count); });
    done += reports.size();
  }
  EXPECT_TRUE(check_invariants(mapper.map()).empty());
  return test::digest(mapper.map());
}

void expect_same_map(const std::vector<Scan>& scans, std::mt19937_64& rng) {
  const std::uint64_t seed = rng();
  std::size_t asked = 0;
  const std::string alone = mapped(scans, 1, seed, [&](std::size_t) -> const Scan* {
    ++asked;
    return nullptr;
  });
  EXPECT_EQ(asked, 0U) << "one thread can do nothing meanwhile";
  const auto next = [&](std::size_t i) -> const Scan* { return i < scans.size() ? &scans[i] : nullptr; };
  EXPECT_TRUE(mapped(scans, 2, seed, next) == alone);
  const auto wrong = [&](std::size_t) -> const Scan* { return &scans[rng() % scans.size()]; };
  EXPECT_TRUE(mapped(scans, 2, seed, wrong) == alone) << "another scan than was expected";
}

TEST(InsertAll, WhatIsDoneAheadChangesNothing) {
  std::mt19937_64 rng = test::rng();
  expect_same_map(recording(rng, 9), rng);
}

TEST(InsertAll, NorDoesItWherePosesAreCorrected) {
  std::mt19937_64 rng = test::rng();
  std::vector<Scan> scans = recording(rng, 12);
  for (int again = 0; again < 2; ++again)
    for (Scan& scan : recording(rng, 12)) {
      scan.T_map_sensor.translation().x() += 0.03;
      scans.push_back(std::move(scan));
    }
  Mapper mapper;
  std::size_t corrected = 0;
  for (const Scan& scan : scans)
    corrected += mapper.insert(scan).alignment.outcome == AlignmentOutcome::corrected;
  ASSERT_GT(corrected, 0U);
  expect_same_map(scans, rng);
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

TEST(InsertAll, AScanIsRoundedIfThatWasAskedForMeanwhile) {
  std::mt19937_64 rng = test::rng();
  const std::vector<Scan> scans = recording(rng, 2);
  Mapper mapper(Parameters(), 2), alone;
  mapper.insert_all({&scans[0], 1}, [&] { return &scans[1]; });
  alone.insert(scans[0]);
  for (Mapper* each : {&mapper, &alone}) {
    each->round_scans();
    each->insert(scans[1]);
  }
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
