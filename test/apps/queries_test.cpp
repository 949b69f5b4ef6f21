// The verbs `query`, `explain` and `view`.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class PlaceQuery : public FloorTest {};

TEST_F(PlaceQuery, SurfacesInABoxAndInASphere) {
  const json inside = ask("--box 0 0 0.1 0.2 0.2 -0.1").at("surfaces");
  ASSERT_EQ(inside.size(), 1U);
  EXPECT_TRUE(ask("--box 0 0 0.1 0.2 0.2 0.3").at("surfaces").empty());
  EXPECT_EQ(ask("--sphere 0.1 0.1 0.5 0.6").at("surfaces"), inside);
  EXPECT_TRUE(ask("--sphere 0.1 0.1 0.5 0.4").at("surfaces").empty());
  EXPECT_THAT(run_well("query m --box 0 0 0.1 0.2 0.2 -0.1").out, HasSubstr("area m²"));
}

TEST_F(PlaceQuery, TheFirstSurfaceOnARay) {
  const json hit = ask("--ray 0.1 0.1 1 0 0 -2");
  EXPECT_NEAR(hit.at("distance_m").get<double>(), 1 - floor_height, 0.005);
  EXPECT_NEAR(hit.at("point").at(2).get<double>(), floor_height, 0.005);
  EXPECT_EQ(hit.at("side"), "front");
  EXPECT_EQ(ask("--ray 0.1 0.1 -1 0 0 1").at("side"), "back");
  EXPECT_TRUE(ask("--ray 0.1 0.1 1 0 0 1").at("surface").is_null());
}

TEST_F(PlaceQuery, AVoxel) {
  const json floor = ask("--voxel 0.1 0.1 " + std::to_string(floor_height));
  EXPECT_EQ(floor.at("state"), "occupied");
  EXPECT_EQ(floor.at("surface"), ask("--sphere 0.1 0.1 0 0.1").at("surfaces").at(0));
  const json air = ask("--voxel 0.1 0.1 0.5");
  EXPECT_EQ(air.at("state"), "free");
  EXPECT_LT(air.at("log_odds").get<double>(), 0);
  EXPECT_EQ(ask("--voxel 0.1 0.1 -0.5").at("state"), "unknown");
}

TEST_F(PlaceQuery, KnowsSlopesAndWhatIsBelow) {
  EXPECT_NEAR(ask("--nearest 0.2 0 0.5").at("slope_deg"), 0, 0.01);
  EXPECT_NEAR(ask("--below 0.2 0 0.5").at("distance_m"), 0.5 - floor_height, 0.003);
  EXPECT_NEAR(ask("--below 0.2 0 -0.5 --up -z").at("distance_m"), 0.5 + floor_height, 0.003);
}

class ContactQueries : public FloorTest {};

TEST_F(ContactQueries, FootholdsAreJudged) {
  const json inside = ask("--foothold 0.2 0 0.3 30 --foot 0.22x0.11");
  EXPECT_EQ(inside.at("accepted"), true);
  EXPECT_TRUE(inside.at("refused").is_null());
  EXPECT_EQ(inside.at("supported"), 1);
  EXPECT_GT(inside.at("margin_m"), 0.1);
  EXPECT_NEAR(inside.at("point").at(2), floor_height, 0.003);
  const json out = ask("--foothold 0.2 5 0 0 --foot 0.22x0.11");
  EXPECT_EQ(out.at("refused"), "support");
  EXPECT_EQ(out.at("supported"), 0);
  EXPECT_EQ(ask("--foothold 0.2 0 0 0 --foot 0.05 --edge-margin 2").at("refused"), "margin");
  EXPECT_EQ(ask("--foothold 0.2 0 0 0 --clearance 0.5").at("accepted"), true);
  EXPECT_EQ(ask("--foothold 0.2 0 0 0 --frontier-margin 2").at("refused"), "frontier");
  EXPECT_THAT(run_well("query m --foothold 0.2 5 0 0").out, HasSubstr("no: support"));
}

TEST_F(ContactQueries, RegionsAgreeWithFootholds) {
  const std::string id = std::to_string(ask("--nearest 0.2 0 0").at("surface").get<int>());
  const json region = ask("--regions " + id + " --foot 0.22x0.11 --yaw 90 --pieces 12");
  EXPECT_TRUE(region.at("refused").empty());
  ASSERT_EQ(region.at("polygons").size(), 1u);
  ASSERT_FALSE(region.at("pieces").empty());
  for (const json& p : region.at("pieces").at(0)) {
    const std::string at = p.at(0).dump() + " " + p.at(1).dump() + " " + p.at(2).dump();
    EXPECT_EQ(ask("--foothold " + at + " 90 --foot 0.22x0.11").at("accepted"), true) << at;
  }
  const json any = ask("--regions " + id + " --foot 0.22x0.11");
  EXPECT_TRUE(any.at("yaw_deg").is_null());
  EXPECT_LT(any.at("area_m2"), region.at("area_m2"));
  EXPECT_EQ(ask("--regions " + id + " --foot 9x9").at("refused"), json({"support"}));
  EXPECT_THAT(run_well("query m --regions " + id + " --foot 9").out, HasSubstr("refused  support"));
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

TEST_F(ViewVerb, RefusesPlansThatAreNoneByName) {
  const std::string head =
      R"({"format":"octosurf-plan","version":1,"found":true,"cost":1,"body":[],"start":[],"steps":)";
  const std::string step = R"({"foot":"left","surface":1,"yaw_deg":0,"margin_m":0,"outline":[],"at":)";
  for (const std::string& text :
       std::vector<std::string>{"", "[1,2]", "{}", R"({"format":"octosurf-plan","version":2})", head + "7}",
                                head + R"([{"foot":"wing"}]})", head + "[7]}", head + "[" + step + "[1,2]}]}",
                                head + "[" + step + "[1,2,1e999]}]}"}) {
    write("bad.json", text);
    EXPECT_THAT(error_of("view m --plan bad.json", 1), HasSubstr("bad")) << text;
    EXPECT_FALSE(exists("m.html"));
  }
}

TEST_F(ViewVerb, TakesSeveralFeetAndPlans) {
  write("none.json",
        R"({"format":"octosurf-plan","version":1,"found":false,"start":[],"steps":[],"body":[]})");
  run_well("view m --foot 0.05 --foot 0.2x0.1@30 --plan none.json --plan none.json");
  EXPECT_TRUE(exists("m.html"));
  EXPECT_THAT(error_of("view m --plan m.html --html m.html --force", 2), HasSubstr("--html"));
}

}  // namespace
}  // namespace octosurf::test
