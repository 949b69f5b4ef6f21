// What simulate() writes, read back by other programs' readers: libspng, PCL, plain text.
#include "evaluation/truth.hpp"
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
  const std::vector<evaluation::TrueFace> written = evaluation::load_truth(recorded_ / "truth.json").faces;
  const auto seen_m2 = [](const evaluation::TrueFace& face) { return face.visible_area_m2; };
  EXPECT_TRUE(std::ranges::equal(written, recording.truth().faces, {}, seen_m2, seen_m2));
  EXPECT_EQ(summary.faces, written.size());
  EXPECT_EQ(summary.visible_faces, std::ranges::count_if(
                                       written, [](double m2) { return m2 >= 0.05; }, seen_m2));
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

// truth.json: what is saved is read back; anything else is refused with the file's name.

class TruthFile : public FolderTest {
 protected:
  static evaluation::Truth example(const std::string& scene = "change") {
    SimulationOptions options;
    options.scene = scene;
    options.frames = 2;
    options.seed = 18446744073709551615u;  // fixed: the largest there is
    return Recording(options).truth();
  }

  std::string text() const { return read_file(file_); }

  void expect_refused(const std::string& content) const {
    write("truth.json", content);
    SCOPED_TRACE(content.substr(0, 200));
    EXPECT_EQ(refusal(Error::Kind::data, [&] { evaluation::load_truth(file_); }).where(), file_.string());
  }

  /// The example's text with the first `from` made `to`.
  std::string spoiled(const std::string& from, const std::string& to) const {
    std::string content = text();
    const auto at = content.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return content.replace(at, from.size(), to);
  }

  const fs::path file_ = dir_ / "truth.json";
};

TEST_F(TruthFile, RoundTripLosesNothing) {
  for (const char* scene : {"change", "spiral"}) {
    const evaluation::Truth saved = example(scene);
    evaluation::save_truth(saved, file_);
    const evaluation::Truth read = evaluation::load_truth(file_);
    const auto header = [](const evaluation::Truth& t) {
      return std::tuple(t.scene, t.sensor, t.seed, t.cell, t.visible_hits, t.faces.size(), t.stairs.size());
    };
    const auto face = [](const evaluation::TrueFace& f) {
      std::vector<std::array<int, 3>> runs;
      for (const auto& run : f.visible) runs.push_back({run.row, run.column, run.count});
      return std::tuple(f.id, f.name, f.gone, f.visible_area_m2, f.plane.normal, f.plane.offset,
                        Eigen::Matrix4d(f.T_map_face.matrix()), f.polygons.size(), f.polygons[0].outer,
                        f.polygons[0].holes, runs);
    };
    ASSERT_EQ(header(read), header(saved));
    for (std::size_t f = 0; f < saved.faces.size(); ++f)
      EXPECT_TRUE(face(read.faces[f]) == face(saved.faces[f])) << f;
    for (std::size_t s = 0; s < saved.stairs.size(); ++s) {
      const evaluation::TrueStair &a = saved.stairs[s], &b = read.stairs[s];
      EXPECT_EQ(std::tie(a.kind, a.riser_m, a.tread_m, a.edges),
                std::tie(b.kind, b.riser_m, b.tread_m, b.edges));
    }
  }
  const std::string without_stairs = spoiled("\"stairs\"", "\"others\"");
  EXPECT_EQ(evaluation::load_truth(file_).stairs.size(), 1u);
  EXPECT_TRUE(evaluation::load_truth(write("truth.json", without_stairs)).stairs.empty());
}

TEST_F(TruthFile, ForeignFilesAreRefused) {
  expect_refused("");
  expect_refused("P5 640 480 65535\n");
  expect_refused("[]");
  expect_refused("{}");
  expect_refused(R"({"format":"octosurf-surfaces","version":1,"surfaces":[]})");
  expect_refused(R"({"format":"octosurf-truth","version":1})");
  expect_refused(std::string(100000, '['));
  EXPECT_THROW(evaluation::load_truth(dir_ / "missing.json"), Error);
  EXPECT_THROW(evaluation::load_truth(dir_), Error);
}

TEST_F(TruthFile, DamagedFieldsAreRefused) {
  evaluation::Truth truth = example();
  truth.faces.resize(2);
  truth.faces[0].visible = {{4, 5, 6}};
  truth.faces[0].plane.offset = 0.125;
  evaluation::save_truth(truth, file_);
  const std::string whole = text();
  const auto refuse = [&](const std::string& field, std::initializer_list<const char*> damaged) {
    for (const char* instead : damaged) {
      write("truth.json", whole);
      expect_refused(spoiled(field, instead));
    }
  };
  refuse("\"version\":1", {"\"version\":2"});
  refuse("\"cell\":0.01", {"\"cell\":-1", "\"cell\":\"0.01\""});
  refuse("\"id\":1,", {"\"id\":0,", "\"id\":2,", "\"id\":1.5,"});
  refuse("\"offset\":0.125", {"\"offset\":1e999", "\"offset\":null"});
  refuse("\"normal\":[", {"\"normal\":[9,"});
  refuse("\"T_map_face\":[", {"\"T_map_face\":[1,"});
  refuse("[4,5,6]", {"[4,5,0]", "[4,5,99999999999]", "[4,5]"});
  refuse("\"visible\":", {"\"seen\":"});
  refuse("\"outer\":[", {"\"outer\":[[1]],\"x\":["});
  refuse("\"gone\":false", {"\"gone\":7"});
}

}  // namespace
}  // namespace octosurf::simulation
