// What `octosurf plan` says and writes; the plans themselves are test/planning's.
#include "apps/command.hpp"

#include <Eigen/Core>
#include <cmath>
#include <fstream>
#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A stair, simulated with few scans and mapped; `from` and `to` stand on its floor and landing.
class PlanVerb : public CommandTest {
 protected:
  PlanVerb() {
    made_once("stairs", [this] {
      run_well("simulate stairs -o scans --frames 24 --noise-scale 0");
      run_well("map scans -o m --resolution 0.03");
      for (const auto& entry : std::filesystem::directory_iterator(folder / "scans"))
        if (entry.path().filename() != "truth.json") std::filesystem::remove(entry);
    });
    const json truth = read_json("scans/truth.json");
    for (const json& face : truth.at("faces")) {
      if (face.at("name") == "stair/top") tread = middle_of(face);
      if (face.at("name") == "stair/top#6") landing = middle_of(face);
    }
    const Eigen::Vector2d up = (landing - tread).head<2>().normalized();
    heading = std::atan2(up.y(), up.x()) * 180 / M_PI;
    Eigen::Vector3d floor = tread;
    floor.head<2>() -= 1.2 * up;
    floor.z() -= 0.18;
    from = words(floor);
    to = words(landing);
  }

  static Eigen::Vector3d middle_of(const json& face) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const json &T = face.at("T_map_face"), &ring = face.at("polygons").at(0).at("outer");
    for (const json& uv : ring)
      for (int i = 0; i < 3; ++i)
        sum[i] += (T.at(4 * i).get<double>() * uv.at(0).get<double>() +
                   T.at(4 * i + 1).get<double>() * uv.at(1).get<double>() + T.at(4 * i + 3).get<double>()) /
                  static_cast<double>(ring.size());
    return sum;
  }
  std::string words(const Eigen::Vector3d& p) const {
    return std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + " " +
           std::to_string(heading);
  }

  Eigen::Vector3d tread, landing;
  double heading = 0;
  std::string from, to;
};

TEST_F(PlanVerb, ClimbsTheStairAndWritesThePlan) {
  const std::string said =
      run_well("plan m --from " + from + " --to " + to + " -o plan.json -o plan.glb --png plan.png").out;
  EXPECT_THAT(said, AllOf(HasSubstr(" steps over "), HasSubstr("\nstart  left"), HasSubstr("    1  ")));
  const json plan = read_json("plan.json");
  EXPECT_EQ(plan.at("format"), "octosurf-plan");
  EXPECT_TRUE(plan.at("found").get<bool>());
  EXPECT_EQ(plan.at("start").size(), 2);
  ASSERT_GE(plan.at("steps").size(), 6);
  EXPECT_EQ(plan.at("body").size(), plan.at("steps").size() + 1);
  const json last = plan.at("steps").back();
  EXPECT_NEAR(last.at("at").at(2).get<double>(), landing.z(), 0.05);
  EXPECT_EQ(last.at("outline").size(), 4);
  EXPECT_THAT(read("plan.glb"), AllOf(StartsWith("glTF"), HasSubstr("step_1_"), HasSubstr("surface_1")));
  EXPECT_THAT(read("plan.png"), HasSubstr("PNG"));
  run_well("plan m --from " + from + " --to " + to + " --png over.png --eye 0 0 6 --target 0 0 0.5");
  EXPECT_FALSE(read("over.png") == read("plan.png"));
  EXPECT_THAT(error_of("plan m --from " + from + " --to " + to + " --png plan.png", 2),
              HasSubstr("plan.png"));
}

TEST_F(PlanVerb, SaysWhyNotInOneLineAndInJson) {
  const std::string high = "--from " + from + " --to " + to + " --max-up 0.1";
  EXPECT_THAT(error_of("plan m " + high, 1),
              AllOf(HasSubstr("every stance within reach was tried"), HasSubstr("it came within ")));
  EXPECT_THAT(error_of("plan m --from 50 0 0 0 --to " + to, 1),
              AllOf(HasSubstr("cannot stand at the start"), HasSubstr("no surface")));
  const Outcome answer = run("plan m --json " + high);
  EXPECT_EQ(answer.code, 1);
  const json plan = json::parse(answer.out);
  EXPECT_FALSE(plan.at("found").get<bool>());
  const json& refusal = plan.at("refusal");
  EXPECT_EQ(refusal.at("why"), "unreachable");
  EXPECT_LT(refusal.at("nearest").at(2).get<double>(), tread.z()) << "the first tread is too high";
  EXPECT_EQ(refusal.at("refused").size(), 5);
}

TEST_F(PlanVerb, ARobotsFileIsOneOfTheTwoWithOtherLimits) {
  const std::string way = " --from " + from + " --to " + to;
  const auto robot = [&](const std::string& json_text) {
    std::ofstream(folder / "robot.json") << json_text;
    return "plan m --robot " + (folder / "robot.json").string() + way;
  };
  run_well(robot(R"({"robot": "biped", "foot": "0.2x0.1", "max_turn_deg": 20})"));
  EXPECT_THAT(error_of(robot(R"({"robot": "biped", "max_up_m": 0.1})"), 1), HasSubstr("too high or too low"));
  EXPECT_THAT(error_of(robot(R"({"robot": "biped", "reach_m": 0.1})"), 1),
              AllOf(HasSubstr("has reach_m, which is none of a biped's limits"), HasSubstr("max_up_m")));
  EXPECT_THAT(error_of(robot(R"({"robot": "biped", "max_up_m": "much"})"), 1), HasSubstr("no number"));
  EXPECT_THAT(error_of(robot(R"({"robot": "snake"})"), 1), HasSubstr("is no robot"));
  EXPECT_THAT(error_of("plan m --robot nowhere.json" + way, 2), HasSubstr("no file that can be read"));
}

}  // namespace
}  // namespace octosurf::test
