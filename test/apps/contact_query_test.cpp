// Footholds and contact regions at the command line.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

class ContactQueries : public CommandTest {
 protected:
  ContactQueries() {
    write_floor();
    run_well("map floor -o m");
  }
  Json ask(const std::string& what) const { return Json::parse(run_well("query m --json " + what).out); }
};

TEST_F(ContactQueries, FootholdsAreJudged) {
  const Json inside = ask("--foothold 0.2 0 0.3 30 --foot 0.22x0.11");
  EXPECT_EQ(inside.at("accepted"), true);
  EXPECT_TRUE(inside.at("refused").is_null());
  EXPECT_EQ(inside.at("supported"), 1);
  EXPECT_GT(inside.at("margin_m"), 0.1);
  EXPECT_NEAR(inside.at("point").at(2), floor_height, 0.003);
  const Json out = ask("--foothold 0.2 5 0 0 --foot 0.22x0.11");
  EXPECT_EQ(out.at("refused"), "support");
  EXPECT_EQ(out.at("supported"), 0);
  EXPECT_EQ(ask("--foothold 0.2 0 0 0 --foot 0.05 --edge-margin 2").at("refused"), "margin");
  EXPECT_EQ(ask("--foothold 0.2 0 0 0 --clearance 0.5 --gap-depth 0.03").at("accepted"), true);
  EXPECT_EQ(ask("--foothold 0.2 0 0 0 --frontier-margin 2").at("refused"), "frontier");
  const std::string text = run_well("query m --foothold 0.2 5 0 0").out;
  EXPECT_THAT(text, HasSubstr("no: support"));
}

TEST_F(ContactQueries, RegionsAgreeWithFootholds) {
  const std::string id = std::to_string(ask("--nearest 0.2 0 0").at("surface").get<int>());
  const Json region = ask("--regions " + id + " --foot 0.22x0.11 --yaw 90 --pieces 12");
  EXPECT_TRUE(region.at("refused").empty());
  ASSERT_EQ(region.at("polygons").size(), 1u);
  ASSERT_FALSE(region.at("pieces").empty());
  for (const Json& p : region.at("pieces").at(0)) {
    const std::string at = p.at(0).dump() + " " + p.at(1).dump() + " " + p.at(2).dump();
    EXPECT_EQ(ask("--foothold " + at + " 90 --foot 0.22x0.11").at("accepted"), true) << at;
  }
  const Json any = ask("--regions " + id + " --foot 0.22x0.11");
  EXPECT_TRUE(any.at("yaw_deg").is_null());
  EXPECT_LT(any.at("area_m2"), region.at("area_m2"));
  const Json none = ask("--regions " + id + " --foot 9x9");
  EXPECT_EQ(none.at("refused"), Json({"support"}));
  EXPECT_THAT(run_well("query m --regions " + id + " --foot 9").out, HasSubstr("refused  support"));
}

}  // namespace
}  // namespace octosurf::test
