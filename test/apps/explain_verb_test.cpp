// What `octosurf explain` says; the reasons themselves are test/mapper's.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class ExplainVerb : public CommandTest {
 protected:
  ExplainVerb() {
    write_floor();
    run_well("map floor -o m");
  }
};

TEST_F(ExplainVerb, SaysItInASentenceThenInFigures) {
  const std::string there = run_well("explain m --at 0.2 0 0.01").out;
  EXPECT_THAT(there, AllOf(StartsWith("There is a surface here: surface 1.\n"), HasSubstr("\nlooked at "),
                           HasSubstr("\nnearest surface  1, ")));
  EXPECT_THAT(run_well("explain m --at 0.2 0 0.5").out, StartsWith("No surface: this is free space.\n"));
  EXPECT_THAT(run_well("explain m --at 0.2 0 -0.5").out,
              StartsWith("No surface: nothing was ever seen here.\n"));
}

TEST_F(ExplainVerb, AnswersInJson) {
  const json there = json::parse(run_well("explain m --at 0.2 0 0.5 --json").out);
  EXPECT_EQ(there.at("reason"), "free_space");
  EXPECT_EQ(there.at("asked"), json({0.2, 0.0, 0.5}));
  EXPECT_TRUE(there.at("looked_at").is_null());
  EXPECT_TRUE(there.at("surface").is_null());
  EXPECT_TRUE(there.at("cylinder").is_null());
  EXPECT_EQ(there.at("nearest").at("surface"), 1);
  EXPECT_NEAR(there.at("nearest").at("distance_m").get<double>(), 0.5 - floor_height, 0.001);
  EXPECT_EQ(there.at("figures"), json::array());
  EXPECT_EQ(there.at("around"), json::object());
}

TEST_F(ExplainVerb, TellsTheFiguresOfARefusal) {
  run_well("map floor -o narrow --first 1 --min-surface-width 1.2");  // an image is 0.98 m wide
  const std::string place = "--at 0 0 " + std::to_string(floor_height);
  const std::string said = run_well("explain narrow " + place).out;
  EXPECT_THAT(said, AllOf(HasSubstr(" m wide, and a surface needs 1.2 m."), HasSubstr("\nwidth "),
                          HasSubstr(", at least 1.2 m\n"), HasSubstr("  too_narrow\n")));
  const json figure = json::parse(run_well("explain narrow " + place + " --json").out).at("figures").at(0);
  EXPECT_EQ(figure.at("name"), "width");
  EXPECT_EQ(figure.at("at_least"), 1.2);
  EXPECT_NEAR(figure.at("value").get<double>(), 59.0 / 60, 0.04);
}

}  // namespace
}  // namespace octosurf::test
