// What is asked of a map: the verbs `query`, `explain`, `view` and `plan`, and planners' own formats of
// `export`. The plans themselves are test/planning's, what is in the files test/io checks.
#include "apps/command.hpp"

namespace octosurf::test {
namespace {

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
  EXPECT_LT(ask("--voxel 0.1 0.1 0.5").at("log_odds"), 0);
  EXPECT_THAT(run_well("query m --patch 0.1 0.1 0.5 30").out, says("heights in cm from the base"));
  EXPECT_THAT(run_well("query m --box 0 0 0.1 0.2 0.2 -0.1").out, says("surfaces             1\n"));
}

TEST_F(Queries, OfFootholds) {
  expect({{"--foothold 0.2 0 0.1 30 --foot 0.22x0.11",
           {{"accepted", true},
            {"refused", nullptr},
            {"supported", 1.0},
            {"ground/supported", 1.0},
            {"margin_m", 0.25},  // of edges farther off nothing is said
            {"point/2", floor_height}}},
          {"--foothold 0.2 0.57 0 0 --foot 0.02",
           {{"refused", "support"}, {"supported", 0.0}, {"ground/unseen", 1.0}}},
          {"--foothold 0.2 0 0 0 --foot 0.05 --edge-margin 2", {{"refused", "margin"}}},
          {"--foothold 0.2 0 0 0 --clearance 0.5", {{"accepted", true}}}});
  EXPECT_THAT(run_well("query m --foothold 0.2 0.57 0 0").out, says("\nrefused              support\n"));
  fails("query m --foothold 0.2 0 1 0", {"surface 1 is 0.98", "m below it", "--below"});
  fails("query m --foothold 0.2 5 0 0", {"surface 1 is 4.5", "m off, and nothing below it"});
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
  EXPECT_THAT(run_well("query m --regions 1 --foot 9").out, says("\nrefused              support\n"));
}

class ExplainVerb : public FloorTest {};

TEST_F(ExplainVerb, SaysItInASentenceThenInFiguresAndInJson) {
  const std::string there = run_well("explain m --at 0.2 0 0.01").out;
  EXPECT_THAT(there, says(" There is a surface here: surface 1.\n", "\nlooked at ",
                          "\nnearest              surface 1, "));
  EXPECT_THAT(run_well("explain m --at 0.2 0 0.5").out, says(" No surface: this is free space.\n"));
  EXPECT_THAT(run_well("explain m --at 0.2 0 -0.5").out, says(" No surface: nothing was ever seen here.\n"));
  const json free = ask("--at 0.2 0 0.5", "explain");
  EXPECT_EQ(free.at("reason"), "free_space");
  EXPECT_EQ(free.at("asked"), json({0.2, 0.0, 0.5}));
  for (const char* key : {"looked_at", "surface", "cylinder"}) EXPECT_TRUE(free.at(key).is_null()) << key;
  EXPECT_EQ(free.at("nearest").at("surface"), 1);
  EXPECT_NEAR(free.at("nearest").at("distance_m"), 0.5 - floor_height, 0.001);
  EXPECT_EQ(free.at("figures"), json::array());
  EXPECT_EQ(free.at("around"), json::object());
}

TEST_F(ExplainVerb, TellsTheFiguresOfARefusal) {
  run_well("map floor -o m --force --first 1 --min-surface-width 1.2");  // an image is 0.98 m wide
  const std::string place = "--at 0 0 " + std::to_string(floor_height);
  EXPECT_THAT(run_well("explain m " + place).out,
              says(" m wide, and a surface needs 1.2 m.", "\nfigures 1\n", "too narrow "));
  const json figure = ask(place, "explain").at("figures").at(0);
  EXPECT_EQ(figure.at("name"), "width");
  EXPECT_EQ(figure.at("at_least"), 1.2);
  EXPECT_NEAR(figure.at("value"), 59.0 / 60, 0.04);
}

/// A stair, simulated with few scans and mapped; `way` leads from its floor to its landing.
class PlanVerb : public CommandTest {
 protected:
  PlanVerb() {
    made_once("stairs", [this] {
      run_well("simulate stairs -o scans --frames 24 --noise-scale 0");
      run_well("map scans -o m --resolution 0.03");
      write("truth.json", read("scans/truth.json"));
      fs::remove_all(folder / "scans");
    });
    const json truth = read_json("truth.json");
    for (const json& face : truth.at("faces")) {
      if (face.at("name") == "stair/top") tread = middle_of(face);
      if (face.at("name") == "stair/top#6") landing = middle_of(face);
    }
    const Eigen::Vector2d up = (landing - tread).head<2>().normalized();
    const double heading = std::atan2(up.y(), up.x()) * 180 / M_PI;
    Eigen::Vector3d floor = tread;
    floor.head<2>() -= 1.2 * up;
    floor.z() -= 0.18;
    std::ostringstream onto, whole;
    onto << " --to " << landing.transpose() << ' ' << heading;
    whole << " --from " << floor.transpose() << ' ' << heading << onto.str();
    to = onto.str();
    way = whole.str();
  }

  static Eigen::Vector3d middle_of(const json& face) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const json &T = face.at("T_map_face"), &ring = face.at("polygons").at(0).at("outer");
    for (const json& uv : ring)
      for (int i = 0; i < 3; ++i)
        sum[i] += T.at(4 * i).get<double>() * uv.at(0).get<double>() +
                  T.at(4 * i + 1).get<double>() * uv.at(1).get<double>() + T.at(4 * i + 3).get<double>();
    return sum / static_cast<double>(ring.size());
  }

  Eigen::Vector3d tread, landing;
  std::string to, way;
};

TEST_F(PlanVerb, ClimbsTheStairAndWritesThePlan) {
  EXPECT_THAT(run_well("plan m" + way + " -o plan.json -o plan.glb --png plan.png").out,
              says(" steps over ", "\nstart  left", "    1  "));
  const json plan = read_json("plan.json"), last = plan.at("steps").back();
  EXPECT_EQ(plan.at("format"), "octosurf-plan");
  EXPECT_TRUE(plan.at("found").get<bool>());
  EXPECT_EQ(plan.at("start").size(), 2);
  ASSERT_GE(plan.at("steps").size(), 6);
  EXPECT_EQ(plan.at("body").size(), plan.at("steps").size() + 1);
  EXPECT_NEAR(last.at("at").at(2), landing.z(), 0.05);
  EXPECT_EQ(last.at("outline").size(), 4);
  EXPECT_THAT(read("plan.glb"), StartsWith("glTF"));
  EXPECT_THAT(read("plan.glb"), says("step_1_", "surface_1"));
  EXPECT_THAT(read("plan.png"), says("PNG"));
  run_well("view m --png bare.png");
  EXPECT_FALSE(read("bare.png") == read("plan.png")) << "footprints are drawn";
  wrong_use("plan m" + way + " --png plan.png", {"plan.png"});
  run_well("export m --to m.json");
  EXPECT_EQ(read_json("m.json").at("surfaces").size(), info("m").at("surfaces"));
}

TEST_F(PlanVerb, SaysWhyNotInOneLineAndInJson) {
  const std::string low = " --robot " + write("low.json", R"({"robot": "biped", "max_up_m": 0.1})").string();
  fails("plan m" + low + way, {"every stance within reach was tried", "it came within "});
  fails("plan m --from 50 0 0 0" + to, {"cannot stand at the start", "no surface"});
  const Outcome answer = run("plan m --json" + low + way);
  EXPECT_EQ(answer.code, 1);
  fails("plan m" + low + way + " -o none.json -o none.glb --png none.png", {"every stance"});
  EXPECT_TRUE(exists("none.json"));
  EXPECT_FALSE(exists("none.glb") || exists("none.png")) << "of no plan there is no picture";
  const json plan = json::parse(answer.out), refusal = plan.at("refusal");
  EXPECT_FALSE(plan.at("found").get<bool>());
  EXPECT_EQ(refusal.at("why"), "unreachable");
  EXPECT_LT(refusal.at("nearest").at(2), tread.z()) << "the first tread is too high";
  EXPECT_EQ(refusal.at("refused").size(), 5);
}

TEST_F(PlanVerb, ARobotsFileIsOneOfTheTwoWithOtherLimits) {
  const auto robot = [&](const std::string& limits) {
    return "plan m --robot " + write("robot.json", limits).string() + way;
  };
  run_well(robot(R"({"robot": "biped", "foot": "0.2x0.1", "max_turn_deg": 20})"));
  fails(robot(R"({"robot": "biped", "max_up_m": 0.1})"), {"too high or too low"});
  wrong_use(robot(R"({"robot": "biped", "min_width_m": 0.5})"), {"stance_width_m"});
  fails(robot(R"({"robot": "biped", "reach_m": 0.1})"),
        {"has reach_m, which is none of a biped's limits", "max_up_m"});
  fails(robot(R"({"robot": "biped", "max_up_m": "much"})"), {"no number"});
  fails(robot(R"({"robot": "snake"})"), {"is no robot"});
  wrong_use("plan m --robot nowhere.json" + way, {"no file that can be read"});
}

TEST_F(Queries, OfRegionsWhereNobodySawOrNothingHangsOverIt) {
  const auto inset_m2 = [this](const std::string& options) {
    return ask("--regions 1 " + options).at("area_m2").get<double>();
  };
  // Of the floor, 79/60 + 0.5 by 59/60 m, a foot leaves the inset, a voxel from its edges. One camera saw it
  // from above, so nobody saw what is over its border.
  constexpr double length = 79.0 / 60 + 0.5 - 2 * 0.02, width = 59.0 / 60 - 2 * 0.02;
  const double disc = inset_m2("--unknown free --foot 0.1");
  EXPECT_NEAR(disc, (length - 0.2) * (width - 0.2), 0.05);
  EXPECT_LT(inset_m2("--foot 0.1"), disc - 0.05);
  EXPECT_NEAR(inset_m2("--unknown free --clearance 0.5"), inset_m2("--unknown free"), 1e-6);
}

}  // namespace
}  // namespace octosurf::test
