// Scans prepared before their insertion: the same map, to the last byte.
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/room_tour.hpp"

#include <future>

namespace octosurf::mapper {
namespace {

std::vector<Scan> recording(int count) {
  std::mt19937_64 rng = test::rng();
  return test::pass_by(test::room_with_a_box(), rng, count);
}

std::string digest_of(const std::vector<Scan>& scans, const Parameters& parameters = {}) {
  return test::digest(test::mapped(scans, parameters).map());
}

/// Contract.PreparationOfScansThatComeTogetherChangesNothing has those that the mapper itself prepares.
TEST(PreparedScan, OfAnotherMapperIsTracedAnewIfItsParametersDiffer) {
  const std::vector<Scan> scans = recording(2);
  const auto expect_same = [&](const auto& change) {
    Parameters parameters;
    change(parameters.occupancy);
    Mapper mapper(parameters);
    const Mapper other;
    for (const Scan& scan : scans) {
      const ScanReport report = mapper.insert(other.prepare(scan));
      EXPECT_EQ(report.points_raw, scan.points.size());
      for (const Stage stage : {Stage::downsample, Stage::occupancy})
        EXPECT_GT(report.stage_ms[static_cast<std::size_t>(stage)], 0);
    }
    EXPECT_TRUE(test::digest(mapper.map()) == digest_of(scans, parameters));
  };
  expect_same([](OccupancyParameters&) {});
  expect_same([](OccupancyParameters& p) { p.resolution = 0.03; });
  expect_same([](OccupancyParameters& p) { p.min_range = 1; });
  expect_same([](OccupancyParameters& p) { p.max_range = 1.5; });
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

}  // namespace
}  // namespace octosurf::mapper
