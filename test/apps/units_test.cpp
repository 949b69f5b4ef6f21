// Readings in another unit, or cut by a limit that nobody stated, are no map without a word.
#include "apps/command.hpp"

#include <Eigen/Core>
#include <cmath>
#include <fstream>
#include <gmock/gmock.h>
#include <numbers>
#include <optional>
#include <sstream>
#include <vector>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class Units : public CommandTest {
 protected:
  /// Depth images, seen from one place, whose rows are `nearest` millimetres away and farther, by `step`.
  void write_depths(const std::string& name, int nearest, int step, const std::string& intrinsics) const {
    std::string image = "P5\n80 60\n65535\n";
    for (int v = 0; v < 60; ++v)
      for (int u = 0; u < 80; ++u) {
        const int depth = nearest + step * v + step * u / 7;
        image += {static_cast<char>(depth >> 8), static_cast<char>(depth & 0xff)};
      }
    write(name + "/0.pgm", image);
    write(name + "/poses.txt", "0 0 0 0 0 0 1\n");
    write(name + "/intrinsics.txt", intrinsics);
  }

  /// A spinning lidar's cloud of a hall of 12 × 8 × 3 m, in units to the metre. `none`: m, range of every
  /// fourth column, whose rays did not return.
  void write_hall(const std::string& name, double units, std::optional<double> none = {},
                  int columns = 512) const {
    std::vector<Eigen::Vector3f> points;
    for (int row = 0; row < 32; ++row)
      for (int column = 0; column < columns; ++column) {
        const double elevation = (row - 15.5) * 2.5 * std::numbers::pi / 180;
        const double azimuth = (column + 0.5) * 2 * std::numbers::pi / columns;
        const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const Eigen::Vector3d side(6, 4, ray.z() > 0 ? 2 : 1);
        const double range = none && column % 4 == 0 ? *none : (side.array() / ray.array().abs()).minCoeff();
        points.push_back((units * range * ray).cast<float>());
      }
    std::string text = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
                       std::to_string(columns) +
                       "\nHEIGHT 32\n"
                       "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
                       std::to_string(32 * columns) + "\nDATA binary\n";
    text.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof points[0]);
    write(name, text);
  }
};

constexpr const char* camera = "60 60 39.5 29.5\n";

TEST_F(Units, AMapOfHardlyAReadingIsRefused) {
  write_depths("far", 4010, 20, camera);
  EXPECT_THAT(error_of("map far -o far", 1),
              AllOf(HasSubstr("mapped, all"), HasSubstr("--depth-scale"), HasSubstr("--max-range"),
                    HasSubstr("nothing is written")));
  EXPECT_FALSE(exists("far.surfaces"));
  run_well("map far -o far --max-range 20");
  EXPECT_TRUE(exists("far.surfaces"));
}

TEST_F(Units, ALimitThatNobodyStatedAndCutsMuchIsTold) {
  write_depths("half", 3000, 35, camera);
  EXPECT_THAT(run("map half -o half").err, AllOf(HasSubstr("beyond 4 m"), HasSubstr("--max-range")));
  EXPECT_THAT(run("map half -o stated --max-range 4").err, Not(HasSubstr("beyond 4 m")));
  write_depths("near", 1000, 20, camera);
  EXPECT_THAT(run("map near -o near").err, Not(HasSubstr("beyond 4 m")));
}

TEST_F(Units, AnOrganisedLidarIsMappedAsFarAsItReaches) {
  write_hall("hall.pcd", 1);
  const Outcome outcome = run_well("map hall.pcd -o hall --resolution 0.1 --viewpoint 0 0 0");
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("spinning lidar"), Not(HasSubstr("only freed space"))));
  const Outcome camera_like = run("map hall.pcd -o camera --resolution 0.1 --sensor camera");
  EXPECT_THAT(camera_like.out, AllOf(HasSubstr("depth camera, as stated"), HasSubstr("only freed space")));
}

TEST_F(Units, ACloudInMillimetresOrCentimetresIsRefused) {
  for (const int units : {100, 1000}) {
    write_hall("hall.pcd", units);
    EXPECT_THAT(error_of("map hall.pcd -o refused --resolution 0.1", 1),
                AllOf(HasSubstr("as if not in metres"), HasSubstr("--cloud-scale 1000")));
    run_well("map hall.pcd -o hall --resolution 0.1 --force --cloud-scale " + std::to_string(units));
  }
}

TEST_F(Units, AValueWithoutReturnThatComesLateIsNamed) {
  constexpr int scans = 22;  // those looked at before the run, and two
  for (int i = 0; i < scans; ++i)
    write_hall("late/" + std::to_string(i) + ".pcd", 1, i + 1 < scans ? std::nullopt : std::optional(100.0));
  const Outcome outcome = run_well("map late -o late/map --resolution 0.1 --report report.json");
  EXPECT_THAT(outcome.out, HasSubstr("4096 readings of its 16384 lie at 100.000 m in all directions"));
}

TEST_F(Units, TheResolutionThatIsAdvisedIsAllowed) {
  write_hall("hall.pcd", 20, {}, 64);  // 19 of 20 readings within 120 m
  EXPECT_THAT(run("map hall.pcd -o hall --resolution 0.1").err, HasSubstr("--resolution 1 or more"));
  run_well("map hall.pcd -o hall --resolution 1 --force");
}

TEST_F(Units, IntrinsicsOfImagesOfAnotherSizeAreRefused) {
  write_depths("near", 1000, 20, "525 525 319.5 239.5\n");
  EXPECT_THAT(error_of("map near -o near", 1),
              AllOf(HasSubstr("images of about 640x480 pixels, not of 80x60"), HasSubstr("times 0.125")));
  write_depths("small", 1000, 20, "30 30 19.5 14.5\n");  // of 40x30
  EXPECT_THAT(error_of("map small -o small", 1), HasSubstr("images of about 40x30 pixels"));
  write_depths("outside", 1000, 20, "60 60 100 29.5\n");
  EXPECT_THAT(error_of("map outside -o outside", 1), HasSubstr("principal point"));
  write_depths("part", 1000, 20, "60 60 60 29.5\n");  // an image's part, cut at the left
  run_well("map part -o part");
}

}  // namespace
}  // namespace octosurf::test
