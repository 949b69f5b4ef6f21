// Scans prepared before their insertion: in less time the same map, to the last byte.
#include "support/guarantees.hpp"
#include "support/room_tour.hpp"
#include "support/testing.hpp"

#include <future>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {
namespace {

std::vector<Scan> recording(int count) {
  std::mt19937_64 rng = test::rng();
  return test::pass_by(test::room_with_a_box(), rng, count);
}

std::string digest_of(const std::vector<Scan>& scans, const Parameters& parameters = {}) {
  Mapper mapper(parameters);
  for (const Scan& scan : scans) mapper.insert(scan);
  return test::digest(mapper.map());
}

double traced_ms(const ScanReport& report) {
  return report.stage_ms[static_cast<std::size_t>(Stage::downsample)] +
         report.stage_ms[static_cast<std::size_t>(Stage::occupancy)];
}

TEST(PreparedScan, GivesTheSameMapWhoeverPreparedIt) {
  const std::vector<Scan> scans = recording(8);
  Mapper mapper;
  const Mapper other;  // of the same parameters
  std::optional<PreparedScan> next(mapper.prepare(scans.front()));
  for (std::size_t i = 0; i < scans.size(); ++i) {
    std::future<PreparedScan> ahead;
    if (i + 1 < scans.size())
      ahead = std::async(std::launch::async,
                         [&, i] { return (i % 3 == 0 ? other : mapper).prepare(scans[i + 1]); });
    const ScanReport report = mapper.insert(*next);
    EXPECT_EQ(report.points_raw, scans[i].points.size());
    EXPECT_GT(report.voxels, 0U);
    if (ahead.valid()) next = ahead.get();
  }
  EXPECT_TRUE(test::digest(mapper.map()) == digest_of(scans));
}

TEST(PreparedScan, OfOtherParametersIsTracedAnew) {
  const std::vector<Scan> scans = recording(2);
  const auto expect_traced_anew = [&](const auto& change) {
    Parameters parameters;
    change(parameters.occupancy);
    Mapper mapper(parameters);
    const Mapper other;
    for (const Scan& scan : scans) mapper.insert(other.prepare(scan));
    EXPECT_TRUE(test::digest(mapper.map()) == digest_of(scans, parameters));
  };
  expect_traced_anew([](OccupancyParameters& p) { p.resolution = 0.03; });
  expect_traced_anew([](OccupancyParameters& p) { p.min_range = 1; });
  expect_traced_anew([](OccupancyParameters& p) { p.max_range = 1.5; });
}

TEST(PreparedScan, WithACorrectedPoseIsTracedAnew) {
  std::vector<Scan> scans = recording(8);
  for (std::size_t i = 5; i < scans.size(); ++i) scans[i].T_map_sensor.translation().x() += 0.05;
  Mapper mapper;
  std::size_t corrected = 0;
  for (const Scan& scan : scans)
    corrected += mapper.insert(mapper.prepare(scan)).alignment.outcome == AlignmentOutcome::corrected;
  EXPECT_GT(corrected, 0U);
  EXPECT_TRUE(test::digest(mapper.map()) == digest_of(scans));
}

TEST(PreparedScan, IsRejectedAsThePlainOneIs) {
  std::vector<Scan> scans = recording(3);
  Mapper mapper;
  mapper.insert(mapper.prepare(scans[0]));
  Scan turned = scans[1], far = scans[1];
  turned.T_map_sensor.linear() *= 2;
  far.T_map_sensor.translation().x() = 1e9;
  for (const Scan& bad : {turned, far}) {
    const PreparedScan prepared = mapper.prepare(bad);
    EXPECT_EQ(prepared.scan().points.size(), bad.points.size());
    EXPECT_THROW(mapper.insert(prepared), Error);
  }
  mapper.insert(mapper.prepare(scans[2]));
  EXPECT_TRUE(test::digest(mapper.map()) == digest_of({scans[0], scans[2]}));
}

TEST(PreparedScan, ItsTimeIsInTheReport) {
  const Scan scan = recording(1).front();
  Mapper mapper;
  const PreparedScan prepared = mapper.prepare(scan);
  const double first_ms = traced_ms(mapper.insert(prepared));
  Mapper alone;
  EXPECT_GT(first_ms, 0);
  EXPECT_GT(traced_ms(alone.insert(PreparedScan(scan))), 0);
}

}  // namespace
}  // namespace octosurf::mapper
