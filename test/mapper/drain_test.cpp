// What a scan's budget leaves waits, and is found in the end.
#include "support/invariants.hpp"
#include "support/room_tour.hpp"
#include "surfaces/map_state.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {
namespace {

Parameters with_budget(int budget) {
  Parameters parameters;
  parameters.detection.detection_budget = budget;
  return parameters;
}

double area_of(const Mapper& mapper) {
  double area = 0;
  for (const SurfacePtr& surface : mapper.snapshot()->surfaces) area += surface->area_m2;
  return area;
}

TEST(Drain, FindsAboutTheAreaThatIsFoundWithoutABudget) {
  Mapper bounded(with_budget(100)), unbounded(with_budget(0));
  const Scan scan = test::room_tour(test::rng(), 1).front();
  EXPECT_GT(bounded.insert(scan).waiting, 100U);
  EXPECT_EQ(unbounded.insert(scan).waiting, 0U);
  EXPECT_LT(area_of(bounded), 0.9 * area_of(unbounded));
  const ScanReport report = bounded.drain();
  EXPECT_FALSE(report.born.empty());
  EXPECT_GT(report.total_ms, 0);
  EXPECT_EQ(report.waiting, 0U);
  EXPECT_TRUE(surfaces::state_of(bounded.map()).queue.blocks.empty());
  EXPECT_NEAR(area_of(bounded), area_of(unbounded), 0.05 * area_of(unbounded));
  EXPECT_EQ(test::check_invariants(bounded.map()), std::vector<std::string>{});
}

TEST(Drain, ChangesNothingIfNothingWaits) {
  Mapper mapper(with_budget(0));
  mapper.drain();
  EXPECT_EQ(mapper.snapshot()->revision, 0U);
  mapper.insert(test::room_tour(test::rng(), 1).front());
  const std::shared_ptr<const Snapshot> before = mapper.snapshot();
  EXPECT_TRUE(mapper.drain().grown.empty());
  EXPECT_EQ(mapper.snapshot(), before);
}

TEST(Drain, WhatWaitsIsFoundByScansThatBringNothing) {
  Mapper mapper(with_budget(100));
  const Scan scan = test::room_tour(test::rng(), 1).front();
  std::size_t waiting = mapper.insert(scan).waiting;
  const double area = area_of(mapper);
  for (int again = 0; again < 30 && waiting > 0; ++again) waiting = mapper.insert(scan).waiting;
  EXPECT_EQ(waiting, 0U);
  EXPECT_GT(area_of(mapper), 1.1 * area);
}

}  // namespace
}  // namespace octosurf::mapper
