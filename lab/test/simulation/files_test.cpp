// What simulate() writes, read back by other programs' readers: libspng, PCL, plain text.
#include "simulation/fixture.hpp"
#include "simulation/recording.hpp"

#include <cstdio>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <spng.h>

namespace octosurf::simulation {
namespace {

namespace fs = std::filesystem;

std::vector<std::uint16_t> read_png(const fs::path& file) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(0), spng_ctx_free);
  spng_set_png_file(context.get(), stream.get());
  spng_ihdr header{};
  EXPECT_EQ(spng_get_ihdr(context.get(), &header), 0) << file;
  EXPECT_EQ(header.width, 640u);
  EXPECT_EQ(header.height, 480u);
  EXPECT_EQ(header.bit_depth, 16);
  EXPECT_EQ(header.color_type, SPNG_COLOR_TYPE_GRAYSCALE);
  std::vector<std::uint16_t> pixels(640 * 480);
  EXPECT_EQ(spng_decode_image(context.get(), pixels.data(), pixels.size() * 2, SPNG_FMT_PNG, 0), 0);
  return pixels;
}

class Folder : public FolderTest {
 protected:
  const fs::path recorded_ = dir_ / "recorded";
};

class DepthFolder : public Folder, public testing::WithParamInterface<std::string> {};
INSTANTIATE_TEST_SUITE_P(Cameras, DepthFolder, testing::Values("depth", "depth-real"),
                         [](const auto& test) { return test.param == "depth" ? "Perfect" : "Real"; });

TEST_P(DepthFolder, IsASevenScenesFolder) {
  const SimulationOptions options = options_of("office", GetParam(), 3);
  std::vector<std::size_t> steps;
  const SimulationSummary summary = simulate(options, recorded_, [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(total, 3u);
    steps.push_back(done);
  });
  EXPECT_EQ(steps, (std::vector<std::size_t>{1, 2, 3}));
  const Recording recording(options);
  std::size_t points = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string stem = (recorded_ / ("frame-00000" + std::to_string(i))).string();
    const Readings readings = recording.measured(i, recording.ideal(i));
    const auto depth = read_png(stem + ".depth.png");
    EXPECT_EQ(read_png(stem + ".label.png"), readings.labels);
    for (std::size_t k = 0; k < depth.size(); ++k) {
      ASSERT_FLOAT_EQ(static_cast<float>(depth[k]) / 1000, readings.t[k]);
      points += depth[k] > 0;
    }
    std::ifstream pose(stem + ".pose.txt");
    Eigen::Matrix4d T;
    for (int k = 0; k < 16; ++k) pose >> T(k / 4, k % 4);
    EXPECT_EQ(T, recording.T_map_sensor(i).matrix()) << "17 digits hold a double";
  }
  EXPECT_EQ(summary.points, points);
  EXPECT_EQ(read_file(recorded_ / "camera-intrinsics.txt"), "525\t0\t319.5\n0\t525\t239.5\n0\t0\t1\n");
  EXPECT_EQ(read_file(recorded_ / "timestamps.txt").substr(0, 43),
            "frame-000000 0.000000\nframe-000001 0.033333");
}

TEST_F(Folder, LidarsArePcdFilesWithPoses) {
  for (const std::string sensor : {"tilting", "spinning"}) {
    SimulationOptions options = options_of("office", sensor, 3);
    options.force = true;
    simulate(options, recorded_);
    const Recording recording(options);
    std::ifstream poses(recorded_ / "poses.txt");
    for (std::size_t i = 0; i < 3; ++i) {
      const LabelledScan expected = recording.labelled_scan(i);
      pcl::PointCloud<pcl::PointXYZL> cloud;
      ASSERT_EQ(
          pcl::io::loadPCDFile((recorded_ / ("scan-00000" + std::to_string(i) + ".pcd")).string(), cloud), 0);
      ASSERT_EQ(cloud.size(), expected.labels.size());
      for (std::size_t k = 0; k < cloud.size(); ++k) {
        ASSERT_EQ(cloud[k].getVector3fMap(), expected.scan.points[k]);
        ASSERT_EQ(cloud[k].label, expected.labels[k]);
      }
      double stamp = 0, x = 0, y = 0, z = 0;
      Eigen::Quaterniond q;
      poses >> stamp >> x >> y >> z >> q.x() >> q.y() >> q.z() >> q.w();
      EXPECT_NEAR(stamp, recording.stamp_s(i), 1e-6);
      EXPECT_LT((Eigen::Vector3d(x, y, z) - expected.scan.T_map_sensor.translation()).norm(), 1e-12);
      EXPECT_LT((q.toRotationMatrix() - expected.scan.T_map_sensor.linear()).norm(), 1e-12);
      EXPECT_LT((cloud.sensor_origin_.head<3>().cast<double>() - Eigen::Vector3d(x, y, z)).norm(), 1e-5);
      EXPECT_LT((cloud.sensor_orientation_.toRotationMatrix().cast<double>() - q.toRotationMatrix()).norm(),
                1e-5);
    }
  }
}

TEST_F(Folder, TruthIsTheRecordings) {
  const SimulationOptions options = options_of("office", "spinning", 3);
  const SimulationSummary summary = simulate(options, recorded_);
  const evaluation::Truth written = evaluation::load_truth(recorded_ / "truth.json");
  const evaluation::Truth expected = Recording(options).truth();
  ASSERT_EQ(written.faces.size(), expected.faces.size());
  EXPECT_EQ(summary.faces, expected.faces.size());
  std::size_t visible = 0;
  for (std::size_t f = 0; f < written.faces.size(); ++f) {
    EXPECT_EQ(written.faces[f].visible_area_m2, expected.faces[f].visible_area_m2);
    visible += written.faces[f].visible_area_m2 >= 0.05;
  }
  EXPECT_EQ(summary.visible_faces, visible);
}

TEST_F(Folder, NothingIsWrittenOverSilently) {
  SimulationOptions options = options_of("office", "tilting", 3);
  fs::create_directories(recorded_);
  std::ofstream(recorded_ / "notes.txt") << "mine";
  std::ofstream(recorded_ / "frame-000007.depth.png") << "old";
  const Error error = refusal(Error::Kind::usage, [&] { simulate(options, recorded_); });
  EXPECT_NE(error.hint().find("--force"), std::string::npos);
  EXPECT_EQ(std::distance(fs::directory_iterator(recorded_), {}), 2);
  options.force = true;
  simulate(options, recorded_);
  EXPECT_EQ(read_file(recorded_ / "notes.txt"), "mine") << "what is no recording stays";
  EXPECT_FALSE(fs::exists(recorded_ / "frame-000007.depth.png"))
      << "an old recording does not mix with the new";
}

TEST_F(Folder, UnwritablePlaceIsAnError) {
  std::ofstream(recorded_.string()) << "a file";
  for (const fs::path& place : {recorded_, recorded_ / "below", fs::path("/proc/octosurf")}) {
    const auto write_there = [&place] { simulate(options_of("office", "tilting", 3), place); };
    EXPECT_EQ(refusal(Error::Kind::output, write_there).where(), place.string());
  }
}

}  // namespace
}  // namespace octosurf::simulation
