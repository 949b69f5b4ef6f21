// Parts of the command by themselves: when scans that wait are mapped together, scans that are read beside
// the work on the ones before, and the report's numbers, from scans whose every number is known.
#include "backlog.hpp"
#include "run_statistics.hpp"
#include "scan_feed.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <future>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <random>

namespace octosurf::test {
namespace {

using nlohmann::json;

constexpr double interval_s = 1.0 / 30;

TEST(FallsBehind, WhereTheNewestWouldWaitForAsLongAsAsManyTakeToArrive) {
  // Eight wait; at 66 ms each they take 0.53 s, which is when 16 have arrived. In units of the interval.
  for (const double interval : {interval_s, 0.1}) {
    EXPECT_FALSE(falls_behind({8 * interval, 1.99 * interval, interval}, 16));
    EXPECT_TRUE(falls_behind({8 * interval, 2.01 * interval, interval}, 16));
    EXPECT_TRUE(falls_behind({8 * interval, 1.99 * interval, interval}, 15));
  }
  EXPECT_FALSE(falls_behind({0, 1, interval_s}, 16)) << "nothing waits";
  EXPECT_FALSE(falls_behind({10, 0, interval_s}, 16)) << "no scan is mapped yet";
  EXPECT_TRUE(falls_behind({0.01, 0.01, 0}, 16)) << "no time between scans: they wait from the first on";
  EXPECT_FALSE(falls_behind({100, 100, interval_s}, 1)) << "none may be joined";
}

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
    const auto cost_s = [&](int) { return factor * interval_s; };
    const FeedOutcome run = map_at_30_hz(3000, 16, cost_s);
    EXPECT_GT(run.joined, 100) << factor;
    // One by one 16 / factor intervals at most and a scan's time; sixteen that are joined take fewer than 14.
    EXPECT_LT(run.most_waited_s, (16 / factor + factor) * interval_s) << factor;
    // Without, the last would wait for 3000 (factor - 1) intervals.
    EXPECT_GT(map_at_30_hz(3000, 1, cost_s).last_waited_s, 0.99 * 3000 * (factor - 1) * interval_s);
  }
  EXPECT_EQ(map_at_30_hz(300, 16, [](int) { return 5 * interval_s; }).joined, 299) << "from the second on";
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

/// Names its scans 0 to 6. Waits in its first next() until it may begin, and notes if it is asked anything
/// meanwhile.
class SevenScans : public ScanSource {
 public:
  std::size_t size() const override {
    if (reading_) disturbed = true;
    return 7;
  }
  std::optional<Scan> next() override {
    if (given_ == 7) return {};
    if (given_ == 0 && wait) {
      reading_ = true;
      wait();
      reading_ = false;
    }
    Scan scan;
    scan.name = std::to_string(given_++);
    return scan;
  }
  const std::vector<std::string>& skipped() const override { return skipped_; }

  std::function<void()> wait;
  static inline std::atomic<bool> disturbed = false;

 private:
  std::atomic<bool> reading_ = false;
  int given_ = 0;
  std::vector<std::string> skipped_;
};

std::vector<std::string> names_of(ScanFeed& feed) {
  std::vector<std::string> names;
  while (const auto scan = feed.next()) names.push_back(scan->name);
  return names;
}

TEST(ScanFeed, ItsSourceIsAskedNothingWhileItReads) {
  std::promise<void> begun, go_on;
  auto source = std::make_unique<SevenScans>();
  source->wait = [&] {
    begun.set_value();
    go_on.get_future().wait();
  };
  ScanFeed feed(std::move(source), {1, 2, 100});
  begun.get_future().wait();
  const std::size_t size = feed.size();
  go_on.set_value();
  EXPECT_EQ(names_of(feed), (std::vector<std::string>{"1", "3", "5"}));
  EXPECT_EQ(size, 3U);
  EXPECT_FALSE(SevenScans::disturbed);
}

TEST(ScanFeed, PeeksAtTheNextScan) {
  ScanFeed feed(std::make_unique<SevenScans>(), {0, 1, 1});
  const Scan* first = feed.peek();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(feed.peek(), first);
  EXPECT_TRUE(feed.next());
  EXPECT_EQ(feed.peek(), nullptr) << "the end";
}

TEST(ScanFeed, LeavesOutWhatIsNotAcceptedAndCountsItAsTaken) {
  std::atomic<int> looked_at{0};
  ScanFeed feed(std::make_unique<SevenScans>(), {1, 1, 5}, 2, [&](const Scan&) { return ++looked_at > 2; });
  EXPECT_EQ(names_of(feed).size(), 3U) << "five after the first, of which two are refused";
  EXPECT_EQ(feed.refused(), 2U);
}

class Statistics : public ::testing::Test {
 protected:
  void add(double stamp_s, double arrival_s, double done_s, std::size_t appeared, std::size_t categorized = 0,
           bool born = false) {
    Scan scan;
    scan.stamp_s = stamp_s;
    ScanReport report;
    report.points_raw = 1000;
    report.appeared = appeared;
    report.categorized = categorized;
    if (born) report.born = {1};
    report.stage_ms[static_cast<std::size_t>(Stage::downsample)] = 10 * stamp_s;
    report.total_ms = 100 * stamp_s;
    statistics.add(scan, report, arrival_s, done_s);
  }
  json report() const { return json::parse(statistics.to_json(map)); }

  Map map;
  RunStatistics statistics{map.parameters()};
};

TEST_F(Statistics, RatesAreOverSensorTime) {
  add(1, 0, 1, 30);
  EXPECT_TRUE(report().at("points_per_second").is_null()) << "one scan spans no time";
  add(2, 5, 6, 20);
  add(3, 7, 8, 10);
  EXPECT_EQ(report().at("scans"), 3);
  EXPECT_EQ(report().at("points_raw"), 3000);
  EXPECT_EQ(report().at("points_new"), 60);
  EXPECT_DOUBLE_EQ(report().at("points_per_second"), 20);  // 60 in 3 − 1 s and a mean period
}

TEST_F(Statistics, FirstDetectionCountsFromTheFirstArrival) {
  add(1, 10, 11, 5);
  EXPECT_TRUE(report().at("time_to_first_detection_s").is_null());
  add(2, 12, 13.5, 5, 0, true);
  add(3, 14, 20, 5, 0, true);
  EXPECT_DOUBLE_EQ(report().at("time_to_first_detection_s"), 3.5);
}

TEST_F(Statistics, LagIsOverPointsNotScans) {
  add(1, 0, 4, 100, 1, true);
  add(2, 10, 11, 100);  // brought nothing that was categorised
  add(3, 20, 20.5, 100, 97);
  add(4, 30, 31, 100, 2);
  const json lag = report().at("detection_lag_s");
  EXPECT_DOUBLE_EQ(lag.at("mean"), (4 * 1 + 0.5 * 97 + 1 * 2) / 100);
  EXPECT_DOUBLE_EQ(lag.at("p50"), 0.5);
  EXPECT_DOUBLE_EQ(lag.at("p95"), 0.5);
  EXPECT_DOUBLE_EQ(lag.at("max"), 4);
}

TEST_F(Statistics, PercentilesAreNearestRank) {
  for (int i = 100; i >= 1; --i) add(i, 0, 1, 1);
  EXPECT_EQ(report().at("scan_ms"),
            json({{"p50", 5000.0}, {"p95", 9500.0}, {"p99", 9900.0}, {"max", 10000.0}}));
  const json stage_ms = report().at("stage_ms").at("downsample");
  EXPECT_DOUBLE_EQ(stage_ms.at("p50"), 500);
  EXPECT_DOUBLE_EQ(stage_ms.at("total"), 50500);
  EXPECT_DOUBLE_EQ(statistics.scan_ms_percentile(0.5), 5000);
}

TEST_F(Statistics, WhatIsNotDefinedIsNull) {
  for (const char* key : {"/points_per_second", "/time_to_first_detection_s", "/categorized_percent",
                          "/scan_ms/p50", "/detection_lag_s/mean"})
    EXPECT_TRUE(report().at(json::json_pointer(key)).is_null()) << key;
  EXPECT_EQ(report().at("stage_ms").at("derive").at("total"), 0);
}

TEST_F(Statistics, ParametersAreNumbersWhereTheyCanBe) {
  Parameters parameters;
  parameters.occupancy.max_range = 2.5;
  const json values = json::parse(parameters_json(parameters));
  EXPECT_EQ(values.size(), parameter_infos().size());
  EXPECT_EQ(values.at("max_range"), 2.5);
  EXPECT_TRUE(values.at("min_surface_points").is_number_integer());
  EXPECT_EQ(values.at("range_noise"), "estimated");
  EXPECT_EQ(values.at("preserve_surfaces"), true);
}

}  // namespace
}  // namespace octosurf::test
