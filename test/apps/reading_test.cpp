// Readings in another unit, cut by a limit that nobody stated, or with poses that are not T_map_sensor are no
// map without a word; nor are poses that jump.
#include "apps/command.hpp"

#include <cmath>
#include <numbers>

#include <octosurf/scan_source.hpp>

namespace octosurf::test {
namespace {

class Units : public CommandTest {
 protected:
  /// Depth images, seen from one place, whose rows are `nearest` millimetres away and farther, by `step`.
  void write_ramp(const std::string& name, int nearest, int step,
                  const std::string& intrinsics = "60 60 39.5 29.5\n") const {
    write_depths(name + "/0.pgm", 80, 60, [&](int u, int v) { return nearest + step * v + step * u / 7; });
    write(name + "/poses.txt", "0 0 0 0 0 0 1\n");
    write(name + "/intrinsics.txt", intrinsics);
  }

  /// A spinning lidar's cloud of a hall of 12 × 8 × 3 m, in units to the metre.
  void write_hall(const std::string& name, double units, int columns = 512) const {
    std::vector<Eigen::Vector3f> points;
    for (int row = 0; row < 32; ++row)
      for (int column = 0; column < columns; ++column) {
        const double elevation = (row - 15.5) * 2.5 * std::numbers::pi / 180;
        const double azimuth = (column + 0.5) * 2 * std::numbers::pi / columns;
        const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const Eigen::Vector3d side(6, 4, ray.z() > 0 ? 2 : 1);
        const double range = (side.array() / ray.array().abs()).minCoeff();
        points.push_back((units * range * ray).cast<float>());
      }
    std::string text = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
                       std::to_string(columns) + "\nHEIGHT 32\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
                       std::to_string(32 * columns) + "\nDATA binary\n";
    text.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof points[0]);
    write(name, text);
  }
};

TEST_F(Units, ALimitThatNobodyStatedAndCutsMuchIsToldOrRefused) {
  write_ramp("far", 4010, 20);
  fails("map far -o far", {"mapped, all", "--depth-scale", "--max-range", "nothing is written"});
  EXPECT_FALSE(exists("far.surfaces"));
  run_well("map far -o far --max-range 20");
  EXPECT_TRUE(exists("far.surfaces"));
  write_ramp("half", 3000, 35);
  EXPECT_THAT(run("map half -o half").out, says("only freed space: beyond max_range"));
}

TEST_F(Units, AnOrganisedLidarIsMappedAsFarAsItReaches) {
  write_hall("hall.pcd", 1);
  const std::string lidar = run_well("map hall.pcd -o hall --resolution 0.1 --viewpoint 0 0 0").out;
  EXPECT_THAT(lidar, Not(HasSubstr("only freed space")));
  EXPECT_THAT(run("map hall.pcd -o camera --resolution 0.1 --sensor camera").out, says("only freed space"));
}

TEST_F(Units, ACloudInMillimetresOrCentimetresIsRefused) {
  for (const int units : {100, 1000}) {
    write_hall("hall.pcd", units);
    fails("map hall.pcd -o refused --resolution 0.1", {"as if not in metres", "--depth-scale 1000"});
    run_well("map hall.pcd -o hall --resolution 0.1 --force --depth-scale " + std::to_string(units));
  }
  write_hall("hall.pcd", 20, 64);  // 19 of 20 readings within 120 m
  run_well("map hall.pcd -o large --resolution 1 --force");
}

TEST_F(Units, IntrinsicsOfImagesOfAnotherSizeAreRefused) {
  write_ramp("near", 1000, 20, "525 525 319.5 239.5\n");
  fails("map near -o near", {"images of about 640x480 pixels, not of 80x60", "times 0.125"});
  write_ramp("small", 1000, 20, "30 30 19.5 14.5\n");  // of 40x30
  fails("map small -o small", {"images of about 40x30 pixels"});
  write_ramp("outside", 1000, 20, "60 60 100 29.5\n");
  fails("map outside -o outside", {"principal point"});
  write_ramp("part", 1000, 20, "60 60 60 29.5\n");  // an image's part, cut at the left
  run_well("map part -o part");
}

class PoseCheck : public CommandTest {
 protected:
  /// Of the simulated room, with each of its poses changed.
  void write_room(const std::string& name, const Change& change) const {
    simulate_room();
    fs::copy(folder / "room", folder / name);
    change_poses(name, change);
  }
};

const Eigen::Matrix4d turned = Eigen::Vector4d(1, -1, -1, 1).asDiagonal();

/// Axes of a body's frame (x forward, z up) in that of a camera (x right, y down, z forward), or the other
/// way.
Eigen::Matrix4d camera_in_body() {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return T;
}

TEST_F(PoseCheck, PosesInAnotherFormAreToldAndTakenOnDemand) {
  simulate_room();
  run_well("map room -o right --resolution 0.1");
  const double area = info("right")["area_m2"].get<double>();
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
      {"opengl-inverse", [](const Eigen::Matrix4d& T) { return (T * turned).inverse().eval(); }},
      {"of-body", [](const Eigen::Matrix4d& T) { return (T * camera_in_body().inverse()).eval(); }}};
  for (const auto& [name, change] : forms) {
    write_room(name, [change = change](const Eigen::Matrix4d& T, int) { return change(T); });
    const std::string map = "map " + name + " --resolution 0.1 -o ";
    EXPECT_THAT(run_well(map + "wrong --force --align off").err, HasSubstr("scans contradict each other"))
        << name;
    EXPECT_THAT(run_well(map + "maps/" + name + " --pose-form " + name).err, Not(HasSubstr("contradict")));
    EXPECT_THAT(run_well("check " + name + " --resolution 0.1").out, HasSubstr("--pose-form " + name));
    EXPECT_NEAR(info("maps/" + name)["area_m2"], area, 0.02 * area) << name;
  }
}

TEST_F(PoseCheck, ACamerasPosesForALidarsScansAreTold) {
  run_well("simulate room -o room --sensor spinning --frames 8");
  const Eigen::Isometry3d T_lidar_camera(camera_in_body());
  std::istringstream in(read("room/poses.txt"));
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
  EXPECT_THAT(run_well(map + " --align off").err, HasSubstr("scans contradict each other"));
  EXPECT_THAT(run_well(map + " --force --pose-form of-camera").err, Not(HasSubstr("contradict")));
}

/// Their poses say where they were seen from.
TEST_F(PoseCheck, CloudsInTheMapsFrameAreTold) {
  run_well("simulate room -o room --sensor spinning --frames 8");
  const auto source = open_scans({folder / "room"});
  for (int i = 0; const std::optional<Scan> scan = source->next(); ++i) {
    std::string rows;
    for (const Eigen::Vector3f& point : scan->points) {
      const Eigen::Vector3d p = scan->T_map_sensor * point.cast<double>();
      if (p.allFinite())
        rows += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    }
    write_pcd("placed/" + std::to_string(i) + ".pcd", rows);
  }
  write("placed/poses.txt", read("room/poses.txt"));
  const std::string of = " --resolution 0.1 ";
  EXPECT_THAT(run_well("map placed -o m --align off" + of).err, HasSubstr("scans contradict each other"));
  EXPECT_THAT(run_well("check placed" + of).out,
              says("lie in the map's frame already", "--pose-form in-map"));
  EXPECT_THAT(run_well("map placed -o m --force --pose-form in-map" + of).err, Not(HasSubstr("contradict")));
  run_well("map room -o right" + of);
  const double area = info("right")["area_m2"].get<double>();
  EXPECT_NEAR(info("m")["area_m2"], area, 0.01 * area);
}

}  // namespace
}  // namespace octosurf::test
