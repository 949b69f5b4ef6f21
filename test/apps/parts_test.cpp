// Parts of the command by themselves: the scans of a range, and the report's numbers, from scans whose every
// number is known.
#include "arrivals.hpp"
#include "run_statistics.hpp"
#include "scan_feed.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <random>

namespace octosurf::test {
namespace {

using nlohmann::json;

/// Names its scans 0 to 6; one comes every 0.1 s.
class SevenScans : public ScanSource {
 public:
  std::size_t size() const override { return 7; }
  std::optional<Scan> next() override {
    if (given_ == 7) return {};
    Scan scan;
    scan.stamp_s = 0.1 * given_;
    scan.name = std::to_string(given_++);
    return scan;
  }
  const std::vector<std::string>& skipped() const override { return skipped_; }

 private:
  int given_ = 0;
  std::vector<std::string> skipped_;
};

std::vector<std::string> names_of(ScanFeed& feed) {
  std::vector<std::string> names;
  while (const auto scan = feed.next()) names.push_back(scan->name);
  return names;
}

TEST(ScanFeed, GivesTheScansOfItsRange) {
  ScanFeed feed(std::make_unique<SevenScans>(), {1, 2, 100});
  EXPECT_EQ(feed.size(), 3U);
  EXPECT_EQ(names_of(feed), (std::vector<std::string>{"1", "3", "5"}));
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
  int looked_at = 0;
  ScanFeed feed(std::make_unique<SevenScans>(), {1, 1, 5}, [&](const Scan&) { return ++looked_at > 2; });
  EXPECT_EQ(names_of(feed).size(), 3U) << "five after the first, of which two are refused";
  EXPECT_EQ(feed.refused(), 2U);
}

TEST(Arrivals, ScansThatHaveWaitedForLongAreMappedTogether) {
  double now_s = 100;
  Arrivals arrivals([&] { return now_s; });
  ScanFeed feed(std::make_unique<SevenScans>(), {});
  std::optional<double> last_stamp_s;
  const auto mapped_at = [&](double since_first_s) {
    now_s = 100 + since_first_s;
    std::vector<PreparedScan> scans;
    scans.emplace_back(*feed.next());
    arrivals.wait_and_join(scans, feed, last_stamp_s);
    last_stamp_s = scans.back().scan().stamp_s;
    return scans.size();
  };
  EXPECT_EQ(mapped_at(0), 1U);
  EXPECT_EQ(mapped_at(0.5), 1U) << "it waited 0.4 s, and so did others for less";
  EXPECT_EQ(mapped_at(0.75), 5U) << "it waited 0.55 s, and the last came at 0.6 s";
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
