// The verbs `query`, `explain` and `view`.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Queries : public FloorTest {
 protected:
  /// Each question, and what stands where in its answer; numbers within 5 mm.
  void expect(const std::vector<std::pair<std::string, json>>& all) const {
    for (const auto& [question, expected] : all) {
      const json answer = ask(question);
      for (const auto& [place, value] : expected.items()) {
        const json& found = answer.at(json::json_pointer("/" + place));
        if (value.is_number_float())
          EXPECT_NEAR(found.get<double>(), value.get<double>(), 0.005) << question << ' ' << place;
        else
          EXPECT_EQ(found, value) << question << ' ' << place;
      }
    }
  }
};

TEST_F(Queries, OfPlaces) {
  const std::string at_floor = std::to_string(floor_height);
  expect({{"--box 0 0 0.1 0.2 0.2 -0.1", {{"surfaces", {1}}}},
          {"--box 0 0 0.1 0.2 0.2 0.3", {{"surfaces", json::array()}}},
          {"--sphere 0.1 0.1 0.5 0.6", {{"surfaces", {1}}}},
          {"--sphere 0.1 0.1 0.5 0.4", {{"surfaces", json::array()}}},
          {"--ray 0.1 0.1 1 0 0 -2",
           {{"distance_m", 1 - floor_height}, {"point/2", floor_height}, {"side", "front"}}},
          {"--ray 0.1 0.1 -1 0 0 1", {{"side", "back"}}},
          {"--ray 0.1 0.1 1 0 0 1", {{"surface", nullptr}}},
          {"--voxel 0.1 0.1 " + at_floor, {{"state", "occupied"}, {"surface", 1}}},
          {"--voxel 0.1 0.1 0.5", {{"state", "free"}}},
          {"--voxel 0.1 0.1 -0.5", {{"state", "unknown"}, {"log_odds", nullptr}}},
          {"--nearest 0.2 0 0.5", {{"slope_deg", 0.0}}},
          {"--below 0.2 0 0.5", {{"distance_m", 0.5 - floor_height}}},
          {"--below 0.2 0 -0.5 --up -z", {{"distance_m", 0.5 + floor_height}}},
          {"--patch 0.1 0.1 0.5 30",  // of 32 × 20 cells one beside the middle
           {{"height_m/330", floor_height - 0.5}, {"cell/330", "supported"}, {"slope_deg/330", 0.0}}}});
  EXPECT_LT(ask("--voxel 0.1 0.1 0.5").at("log_odds").get<double>(), 0);
  EXPECT_THAT(run_well("query m --patch 0.1 0.1 0.5 30").out, HasSubstr("heights in cm from the base"));
  EXPECT_THAT(run_well("query m --box 0 0 0.1 0.2 0.2 -0.1").out, HasSubstr("area m²"));
}

TEST_F(Queries, OfFootholds) {
  expect({{"--foothold 0.2 0 0.3 30 --foot 0.22x0.11",
           {{"accepted", true},
            {"refused", nullptr},
            {"supported", 1.0},
            {"ground/supported", 1.0},
            {"margin_m", 0.25},  // of edges farther off nothing is said
            {"point/2", floor_height}}},
          {"--foothold 0.2 5 0 0 --foot 0.22x0.11",
           {{"refused", "support"}, {"supported", 0.0}, {"ground/unseen", 1.0}}},
          {"--foothold 0.2 0 0 0 --foot 0.05 --edge-margin 2", {{"refused", "margin"}}},
          {"--foothold 0.2 0 0 0 --clearance 0.5", {{"accepted", true}}},
          {"--foothold 0.2 0 0 0 --frontier-margin 2", {{"refused", "frontier"}}}});
  EXPECT_THAT(run_well("query m --foothold 0.2 5 0 0").out, HasSubstr("no: support"));
}

TEST_F(Queries, OfRegionsAgreeWithThoseOfFootholds) {
  const json region = ask("--regions 1 --foot 0.22x0.11 --yaw 90 --pieces 12");
  EXPECT_TRUE(region.at("refused").empty());
  ASSERT_EQ(region.at("polygons").size(), 1u);
  ASSERT_FALSE(region.at("pieces").empty());
  for (const json& p : region.at("pieces").at(0)) {
    const std::string at = p.at(0).dump() + " " + p.at(1).dump() + " " + p.at(2).dump();
    EXPECT_EQ(ask("--foothold " + at + " 90 --foot 0.22x0.11").at("accepted"), true) << at;
  }
  const json any = ask("--regions 1 --foot 0.22x0.11");
  EXPECT_TRUE(any.at("yaw_deg").is_null());
  EXPECT_LT(any.at("area_m2"), region.at("area_m2"));
  expect({{"--regions 1 --foot 0.22x0.11 --yaw 90 --about 0.2 0 0 --reach 0.1", {{"area_m2", 0.04}}},
          {"--regions 1 --foot 9x9", {{"refused", {"support"}}}}});
  EXPECT_THAT(run_well("query m --regions 1 --foot 9").out, HasSubstr("refused  support"));
}

class ExplainVerb : public FloorTest {};

TEST_F(ExplainVerb, SaysItInASentenceThenInFigures) {
  const std::string there = run_well("explain m --at 0.2 0 0.01").out;
  EXPECT_THAT(there, AllOf(StartsWith("There is a surface here: surface 1.\n"), HasSubstr("\nlooked at "),
                           HasSubstr("\nnearest surface  1, ")));
  EXPECT_THAT(run_well("explain m --at 0.2 0 0.5").out, StartsWith("No surface: this is free space.\n"));
  EXPECT_THAT(run_well("explain m --at 0.2 0 -0.5").out,
              StartsWith("No surface: nothing was ever seen here.\n"));
}

TEST_F(ExplainVerb, AnswersInJson) {
  const json there = ask("--at 0.2 0 0.5", "explain");
  EXPECT_EQ(there.at("reason"), "free_space");
  EXPECT_EQ(there.at("asked"), json({0.2, 0.0, 0.5}));
  for (const char* key : {"looked_at", "surface", "cylinder"}) EXPECT_TRUE(there.at(key).is_null()) << key;
  EXPECT_EQ(there.at("nearest").at("surface"), 1);
  EXPECT_NEAR(there.at("nearest").at("distance_m").get<double>(), 0.5 - floor_height, 0.001);
  EXPECT_EQ(there.at("figures"), json::array());
  EXPECT_EQ(there.at("around"), json::object());
}

TEST_F(ExplainVerb, TellsTheFiguresOfARefusal) {
  run_well("map floor -o m --force --first 1 --min-surface-width 1.2");  // an image is 0.98 m wide
  const std::string place = "--at 0 0 " + std::to_string(floor_height);
  EXPECT_THAT(run_well("explain m " + place).out,
              AllOf(HasSubstr(" m wide, and a surface needs 1.2 m."), HasSubstr("\nwidth "),
                    HasSubstr(", at least 1.2 m\n"), HasSubstr("  too_narrow\n")));
  const json figure = ask(place, "explain").at("figures").at(0);
  EXPECT_EQ(figure.at("name"), "width");
  EXPECT_EQ(figure.at("at_least"), 1.2);
  EXPECT_NEAR(figure.at("value").get<double>(), 59.0 / 60, 0.04);
}

class ViewVerb : public FloorTest {
 protected:
  void SetUp() override {
    const Outcome probe = run("view m --foot none --html probe.html");
    if (probe.err.find("built without the page") != std::string::npos) GTEST_SKIP() << probe.err;
  }
};

TEST_F(ViewVerb, TakesSeveralFeet) {
  run_well("view m --foot 0.05 --foot 0.2x0.1");
  EXPECT_TRUE(exists("m.html"));
}

}  // namespace
}  // namespace octosurf::test
