// Up on the command line: given, estimated, and asked for otherwise than the map has it.
#include "apps/command.hpp"

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <numbers>
#include <sstream>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class UpOption : public FloorTest {
 protected:
  nlohmann::json up_of(const std::string& map, const std::string& more = {}) const {
    return nlohmann::json::parse(run_well("info " + map + " --json " + more).out).at("up");
  }
  double slope_of_first(const std::string& more) const {
    return ask(more, "info").at("largest").at(0).at("slope_deg");
  }
};

using Json = nlohmann::json;

TEST_F(UpOption, GivenInEveryWay) {
  EXPECT_EQ(up_of("m").at("direction"), Json({0.0, 0.0, 1.0}));
  write("o.cfg", "up = 0 -1 0\n");
  for (const char* up : {"--up -y", "--up 0 -2 0", "--up=-y", "--up 0,-2,0", "--config o.cfg"}) {
    run_well(std::string("map floor --force -o m --first 1 ") + up);
    EXPECT_EQ(up_of("m").at("direction"), Json({0.0, -1.0, 0.0})) << up;
    EXPECT_EQ(up_of("m").at("from"), "given");
  }
}

TEST_F(UpOption, AutoIsToldInReportAndInfo) {
  const std::string out = run_well("map floor -o m --force --up auto --report r.json").out;
  EXPECT_THAT(out, HasSubstr("estimated from"));
  const Json up = read_json("r.json").at("up");
  EXPECT_EQ(up.at("from"), "surfaces");
  EXPECT_NEAR(up.at("direction").at(2), 1, 1e-6);
  EXPECT_GT(up.at("level_m2"), 1);
  EXPECT_EQ(read_json("r.json").at("parameters").at("up_z"), "estimated");
  EXPECT_EQ(up_of("m"), up);
  EXPECT_THAT(run_well("info m").out, HasSubstr("estimated from"));
}

TEST_F(UpOption, AskedForOtherwise) {
  EXPECT_NEAR(slope_of_first(""), 0, 0.01);
  EXPECT_NEAR(slope_of_first("--up x"), 90, 0.01);
  EXPECT_NEAR(slope_of_first("--up -z"), 180, 0.01);
  EXPECT_NEAR(slope_of_first("--up auto"), 0, 0.01);
  EXPECT_EQ(up_of("m", "--up auto").at("from"), "surfaces");
  run_well("view m --png z.png --width 64 --height 64");
  run_well("view m --png same.png --width 64 --height 64 --up 0 0 1");
  run_well("view m --png y.png --width 64 --height 64 --up -y");
  EXPECT_EQ(read("z.png"), read("same.png"));
  EXPECT_NE(read("z.png"), read("y.png"));
}

TEST_F(UpOption, AnotherAxisIsSuggested) {
  // The floor in a frame whose y is up: turned by -90 degrees about x.
  std::istringstream poses(read("floor/poses.txt"));
  std::ostringstream turned;
  for (double x, y, z, qx, qy, qz, qw; poses >> x >> y >> z >> qx >> qy >> qz >> qw;) {
    const Eigen::AngleAxisd turn(-std::numbers::pi / 2, Eigen::Vector3d::UnitX());
    const Eigen::Vector3d t = turn * Eigen::Vector3d(x, y, z);
    const Eigen::Quaterniond q = turn * Eigen::Quaterniond(qw, qx, qy, qz);
    turned << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' '
           << q.w() << '\n';
  }
  write("turned.txt", turned.str());
  const std::string suggestion = "that up is y (";
  const auto errors = [&](const std::string& arguments) { return run_well(arguments).err; };
  EXPECT_THAT(errors("map floor --poses turned.txt -o y"), HasSubstr(suggestion));
  EXPECT_THAT(errors("info y"), HasSubstr(suggestion));
  EXPECT_THAT(errors("export y --to y.ply"), HasSubstr(suggestion));
  EXPECT_THAT(errors("view y --png y.png --width 64 --height 64"), HasSubstr(suggestion));
  run_well("view y --png as_y.png --width 64 --height 64 --up y");
  EXPECT_EQ(read("y.png"), read("as_y.png")) << "drawn by what is suggested";
  EXPECT_THAT(run("view y --foot none --html y.html").err, HasSubstr(suggestion));  // with a page or without
  EXPECT_THAT(errors("export y --to auto.ply --up auto"), Not(HasSubstr(suggestion)));
  EXPECT_THAT(errors("map floor -o z"), Not(HasSubstr("suggest")));
}

TEST_F(UpOption, WallsThatAreMoreThanTheFloorHideNoOtherAxis) {
  // In a frame whose y is up: a floor of 3.6 m², seen by cameras that look down, and a wall of 4.7 m², level
  // to z, seen by twice as many that are held upright.
  write_floor("corner", 12);
  std::ostringstream poses;
  for (int i = 0; i < 4; ++i) poses << 0.8 * i << " 1 0 0.70710678 0 0 0.70710678\n";  // look along -y
  for (int i = 0; i < 8; ++i) poses << 0.5 * i << " 1.5 0 1 0 0 0\n";                  // along -z
  write("corner/poses.txt", poses.str());
  EXPECT_THAT(run_well("map corner -o y").err, HasSubstr("that up is y (3."));
}

TEST_F(UpOption, AMapThatIsGoneOnWithMayGetAnother) {
  run_well("map floor --resume m --first 1 --up auto");
  EXPECT_EQ(up_of("m").at("from"), "surfaces");
  run_well("map floor -o n --resume m");
  EXPECT_EQ(up_of("n").at("from"), "surfaces") << "kept";
}

}  // namespace
}  // namespace octosurf::test
