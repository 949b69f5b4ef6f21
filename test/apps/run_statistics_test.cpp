// The report's numbers, from scans whose every number is known.
#include "run_statistics.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace octosurf::test {
namespace {

using nlohmann::json;

class Statistics : public ::testing::Test {
 protected:
  void add(double stamp_s, double arrival_s, double done_s, std::size_t appeared, std::size_t categorized,
           bool born) {
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
  add(1, 0, 1, 30, 0, false);
  add(2, 5, 6, 20, 0, false);
  add(3, 7, 8, 10, 0, false);
  EXPECT_EQ(report().at("scans"), 3);
  EXPECT_EQ(report().at("points_raw"), 3000);
  EXPECT_EQ(report().at("points_new"), 60);
  EXPECT_DOUBLE_EQ(report().at("points_per_second"), 20);  // 60 in 3 − 1 s and a mean period
}

TEST_F(Statistics, FirstDetectionCountsFromTheFirstArrival) {
  add(1, 10, 11, 5, 0, false);
  EXPECT_TRUE(report().at("time_to_first_detection_s").is_null());
  add(2, 12, 13.5, 5, 0, true);
  add(3, 14, 20, 5, 0, true);
  EXPECT_DOUBLE_EQ(report().at("time_to_first_detection_s"), 3.5);
}

TEST_F(Statistics, LagIsOverPointsNotScans) {
  add(1, 0, 4, 100, 1, true);
  add(2, 10, 11, 100, 0, false);  // brought nothing that was categorised
  add(3, 20, 20.5, 100, 97, false);
  add(4, 30, 31, 100, 2, false);
  const json lag = report().at("detection_lag_s");
  EXPECT_DOUBLE_EQ(lag.at("mean"), (4 * 1 + 0.5 * 97 + 1 * 2) / 100);
  EXPECT_DOUBLE_EQ(lag.at("p50"), 0.5);
  EXPECT_DOUBLE_EQ(lag.at("p95"), 0.5);
  EXPECT_DOUBLE_EQ(lag.at("max"), 4);
}

TEST_F(Statistics, PercentilesAreNearestRank) {
  for (int i = 100; i >= 1; --i) add(i, 0, 1, 1, 0, false);
  const json scan_ms = report().at("scan_ms"), stage_ms = report().at("stage_ms").at("downsample");
  EXPECT_DOUBLE_EQ(scan_ms.at("p50"), 5000);
  EXPECT_DOUBLE_EQ(scan_ms.at("p95"), 9500);
  EXPECT_DOUBLE_EQ(scan_ms.at("p99"), 9900);
  EXPECT_DOUBLE_EQ(scan_ms.at("max"), 10000);
  EXPECT_DOUBLE_EQ(stage_ms.at("p50"), 500);
  EXPECT_DOUBLE_EQ(stage_ms.at("total"), 50500);
  EXPECT_DOUBLE_EQ(statistics.scan_ms_percentile(0.5), 5000);
}

TEST_F(Statistics, WhatIsNotDefinedIsNull) {
  const json empty = report();
  for (const char* key : {"points_per_second", "time_to_first_detection_s", "categorized_percent"})
    EXPECT_TRUE(empty.at(key).is_null()) << key;
  EXPECT_TRUE(empty.at("scan_ms").at("p50").is_null());
  EXPECT_TRUE(empty.at("detection_lag_s").at("mean").is_null());
  EXPECT_EQ(empty.at("stage_ms").at("derive").at("total"), 0);
  add(7, 0, 1, 5, 0, false);
  EXPECT_TRUE(report().at("points_per_second").is_null());  // one scan spans no time
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
