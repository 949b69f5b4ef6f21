// When scans that wait are mapped together.
#include "backlog.hpp"

#include "support/seed.hpp"

#include <algorithm>
#include <functional>
#include <gtest/gtest.h>
#include <random>

namespace octosurf::test {
namespace {

constexpr double interval_s = 1.0 / 30;

TEST(FallsBehind, WhereTheNewestWouldWaitForAsLongAsAsManyTakeToArrive) {
  // Eight wait; at 66 ms each they take 0.53 s, which is when 16 have arrived.
  EXPECT_FALSE(falls_behind({8 * interval_s, 1.99 * interval_s, interval_s}, 16));
  EXPECT_TRUE(falls_behind({8 * interval_s, 2.01 * interval_s, interval_s}, 16));
  EXPECT_TRUE(falls_behind({8 * interval_s, 1.99 * interval_s, interval_s}, 15));
  // In units of the interval, whatever it is.
  EXPECT_FALSE(falls_behind({8 * 0.1, 1.99 * 0.1, 0.1}, 16));
  EXPECT_TRUE(falls_behind({8 * 0.1, 2.01 * 0.1, 0.1}, 16));
}

TEST(FallsBehind, NotWhereNothingWaitsOrNothingIsKnown) {
  EXPECT_FALSE(falls_behind({0, 1, interval_s}, 16));
  EXPECT_FALSE(falls_behind({10, 0, interval_s}, 16)) << "no scan is mapped yet";
}

TEST(FallsBehind, ScansWithoutTimeBetweenThemWaitFromTheFirstOn) {
  EXPECT_TRUE(falls_behind({0.01, 0.01, 0}, 16));
}

TEST(FallsBehind, NeverWhereNoneMayBeJoined) { EXPECT_FALSE(falls_behind({100, 100, interval_s}, 1)); }

struct FeedOutcome {
  int joined = 0;  ///< scans
  double most_waited_s = 0;
  double last_waited_s = 0;
};

/// A mapper to which scans come at `interval_s`. `cost_s`: of the i-th by itself; of those that are joined a
/// third for each, and of two of them the rest: their surfaces are looked for twice.
FeedOutcome map_at_30_hz(int scans, std::size_t together, const std::function<double(int)>& cost_s) {
  Backlog backlog(together);
  FeedOutcome run;
  double now_s = 0;
  for (int i = 0; i < scans;) {
    const double arrival_s = i * interval_s;
    backlog.next(arrival_s, run.last_waited_s = now_s - arrival_s);
    run.most_waited_s = std::max(run.most_waited_s, run.last_waited_s);
    now_s = std::max(now_s, arrival_s);
    std::size_t count = 1;
    double took_s = cost_s(i), dearest_s = took_s;
    for (int next = i + 1; backlog.join() && next < scans && count < together && next * interval_s <= now_s;
         ++next, ++count) {
      backlog.joined(next * interval_s);
      took_s += cost_s(next) / 3;
      dearest_s = std::max(dearest_s, cost_s(next));
    }
    if (count > 1) {
      took_s += 2.0 / 3 * dearest_s;
      run.joined += static_cast<int>(count);
    }
    now_s += took_s;
    backlog.mapped(took_s);
    i += static_cast<int>(count);
  }
  return run;
}

/// As it is where a place is new: the first scans are dear, and now and then a second of them is.
TEST(Backlog, BurstsOfAMapperThatKeepsUpAreWaitedOut) {
  std::mt19937_64 rng(test::seed());
  std::uniform_real_distribution<double> factor(0.8, 1.2);
  const FeedOutcome run = map_at_30_hz(3000, 16, [&](int i) {
    const double dear = i < 2 ? 2.5 : i % 150 > 119 ? 1.25 : 0.75;
    return dear * factor(rng) * interval_s;
  });
  EXPECT_GT(run.most_waited_s, 3 * interval_s) << "there were bursts";
  EXPECT_EQ(run.joined, 0);
}

TEST(Backlog, AMapperThatIsTooSlowJoinsBeforeScansWaitForLong) {
  for (const double factor : {1.1, 1.5, 2.0}) {
    const FeedOutcome run = map_at_30_hz(3000, 16, [&](int) { return factor * interval_s; });
    EXPECT_GT(run.joined, 100) << factor;
    // One by one 16 / factor intervals at most and a scan's time; sixteen that are joined take fewer than 14.
    EXPECT_LT(run.most_waited_s, (16 / factor + factor) * interval_s) << factor;
    // Without, the last would wait for 3000 (factor - 1) intervals.
    EXPECT_GT(map_at_30_hz(3000, 1, [&](int) { return factor * interval_s; }).last_waited_s,
              0.99 * 3000 * (factor - 1) * interval_s);
  }
}

TEST(Backlog, AMapperThatIsFarTooSlowJoinsFromTheSecondScanOn) {
  const FeedOutcome run = map_at_30_hz(300, 16, [](int) { return 5 * interval_s; });
  EXPECT_EQ(run.joined, 299);
}

TEST(Backlog, WhatHasCaughtUpMapsOneByOneAgain) {
  const FeedOutcome run = map_at_30_hz(3000, 16, [](int i) { return (i < 100 ? 2.5 : 0.5) * interval_s; });
  EXPECT_GT(run.joined, 50);
  EXPECT_LT(run.joined, 130);
  EXPECT_LE(run.last_waited_s, 0);
}

TEST(Backlog, RecordingsThatFollowEachOtherMayGoBackInTime) {
  Backlog backlog(16);
  backlog.next(1000, 0);
  backlog.mapped(0.02);
  backlog.next(3, 997);
  EXPECT_TRUE(backlog.join());
  backlog.mapped(0.02);
  backlog.next(3.03, -1);
  EXPECT_FALSE(backlog.join());
}

}  // namespace
}  // namespace octosurf::test
