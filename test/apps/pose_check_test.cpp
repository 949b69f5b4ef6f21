// Poses that are not T_map_sensor, and cameras that look along -z, are noticed before a map is made of them.
#include "apps/command.hpp"

#include <Eigen/Dense>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <sstream>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class PoseCheck : public CommandTest {
 protected:
  /// A copy of a recording, each of its poses (4×4 in a file of its own) changed.
  void change_poses(const std::string& recording, const std::string& copy,
                    const std::function<Eigen::Matrix4d(const Eigen::Matrix4d&)>& change) const {
    std::filesystem::copy(folder / recording, folder / copy, std::filesystem::copy_options::recursive);
    std::size_t changed = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / copy)) {
      if (!entry.path().string().ends_with(".pose.txt")) continue;
      Eigen::Matrix4d T;
      std::ifstream in(entry.path());
      for (int i = 0; i < 16; ++i) in >> T(i / 4, i % 4);
      in.close();
      std::ofstream out(entry.path());
      out.precision(17);
      out << change(T) << '\n';
      ++changed;
    }
    ASSERT_GT(changed, 0u);
  }
};

const Eigen::Matrix4d turned = Eigen::Vector4d(1, -1, -1, 1).asDiagonal();

TEST_F(PoseCheck, PosesInAnotherFormAreRefusedAndTakenOnDemand) {
  simulate_room();
  const double area = [&] {
    run_well("map room -o right --resolution 0.1");
    return info("right")["area_m2"].get<double>();
  }();
  const std::vector<std::pair<std::string, std::function<Eigen::Matrix4d(const Eigen::Matrix4d&)>>> forms{
      {"inverse", [](const Eigen::Matrix4d& T) { return T.inverse().eval(); }},
      {"w-first",
       [](const Eigen::Matrix4d& T) {  // as if w x y z were x y z w
         const Eigen::Quaterniond q(Eigen::Matrix3d(T.topLeftCorner<3, 3>()));
         Eigen::Matrix4d read = T;
         read.topLeftCorner<3, 3>() = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
         return read;
       }},
      {"opengl", [](const Eigen::Matrix4d& T) { return (T * turned).eval(); }},
      {"opengl-inverse", [](const Eigen::Matrix4d& T) { return (T * turned).inverse().eval(); }}};
  for (const auto& [name, change] : forms) {
    change_poses("room", name, change);
    EXPECT_THAT(error_of("map " + name + " -o wrong --resolution 0.1", 1),
                AllOf(HasSubstr("taken as " + name + ";"), HasSubstr("nothing is written"),
                      HasSubstr("--pose-form " + name)));
    EXPECT_FALSE(exists("wrong.surfaces"));
    run_well("map " + name + " -o maps/" + name + " --resolution 0.1 --pose-form " + name);
    EXPECT_NEAR(info("maps/" + name)["area_m2"].get<double>(), area, 0.02 * area) << name;
  }
  run_well("map inverse -o wrong --resolution 0.1 --pose-form as-given");
  EXPECT_TRUE(exists("wrong.surfaces"));

  // Optical data with the frame of the body: the only form that is taken unasked.
  Eigen::Matrix4d T_body_camera = Eigen::Matrix4d::Identity();
  T_body_camera.topLeftCorner<3, 3>() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  change_poses("room", "body",
               [&](const Eigen::Matrix4d& T) { return (T * T_body_camera.inverse()).eval(); });
  EXPECT_THAT(run_well("map body -o maps/body --resolution 0.1").out,
              HasSubstr("begun anew with --pose-form of-body"));
  EXPECT_NEAR(info("maps/body")["area_m2"].get<double>(), area, 0.02 * area);
  EXPECT_THAT(error_of("map body -o kept --resolution 0.1 --keep-scans kept", 1),
              HasSubstr("--pose-form of-body"));
}

TEST_F(PoseCheck, PosesInAnotherUnitThanTheReadingsAreRefused) {
  simulate_room();
  for (const auto& [name, scale] :
       {std::pair("4", 4.0), {"1000", 1000.0}, {"0.25", 0.25}, {"10", 10.0}, {"0.2", 0.2}}) {
    change_poses("room", name, [scale = scale](Eigen::Matrix4d T) {
      T.topRightCorner<3, 1>() /= scale;
      return T;
    });
    const std::string line = error_of("map " + std::string(name) + " -o wrong --resolution 0.1", 1);
    EXPECT_THAT(line,
                AllOf(HasSubstr("--cloud-scale " + std::string(name)), HasSubstr("nothing is written")));
    EXPECT_FALSE(exists("wrong.surfaces"));
  }
  run_well("map 4 -o wrong --resolution 0.1 --depth-scale 1000");
}

TEST_F(PoseCheck, ACamerasPosesForALidarsScansAreRefused) {
  run_well("simulate room -o room --sensor spinning --frames 8");
  // x right, y down, z forward; the camera stands by the lidar, at a few hundredths of the usual range.
  Eigen::Isometry3d T_lidar_camera = Eigen::Isometry3d::Identity();
  T_lidar_camera.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T_lidar_camera.translation() << 0.06, 0, -0.04;
  std::ifstream in(folder / "room/poses.txt");
  std::ostringstream out;
  out.precision(17);
  double stamp = 0;
  Eigen::Vector3d t;
  Eigen::Quaterniond q;
  while (in >> stamp >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w()) {
    const Eigen::Isometry3d T = Eigen::Translation3d(t) * q.normalized() * T_lidar_camera;
    for (int i = 0; i < 12; ++i) out << T(i / 4, i % 4) << (i < 11 ? ' ' : '\n');
  }
  write("camera.txt", out.str());
  const std::string map = "map room --poses camera.txt -o map --resolution 0.1";
  EXPECT_THAT(error_of(map, 1), HasSubstr("--pose-form of-camera"));
  run_well(map + " --pose-form of-camera");
}

TEST_F(PoseCheck, RightPosesAreNotRefusedWhereTheyDrift) {
  run_well("simulate corridor -o corridor --length 8 --laps 2 --frames 24 --drift-m 0.3 --drift-deg 3");
  run_well("map corridor -o corridor --resolution 0.1");
}

}  // namespace
}  // namespace octosurf::test
