// Bags that others wrote give the very scans of the folders they were made of.
#include "io/readers/bag_files.hpp"

namespace octosurf::test {
namespace {

using ::testing::ElementsAre;

namespace fs = std::filesystem;

struct Written {
  const char* bag;
  const char* options;
  bool images;
};
std::string name_of(const ::testing::TestParamInfo<Written>& info) {
  std::string name =
      std::string(info.param.images ? "Images_" : "Clouds_") + info.param.bag + "_" + info.param.options;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return name;
}

class ScansInBag : public BagFiles, public ::testing::WithParamInterface<Written> {};

TEST_P(ScansInBag, AreThoseOfTheFolder) {
  const std::string options = GetParam().options;
  const fs::path recording = GetParam().images ? write_images() : write_clouds();
  const auto expected = read_all({recording});
  // Where tf is a product of two turns, its rounding is not the folder's.
  const bool chain = options.find("chain") != std::string::npos;
  const auto scans = read_all({write_bag(recording, GetParam().bag, options)});
  expect_same_scans(scans, expected, chain ? 1e-15 : 0);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(scans.at(i).sensor, expected[i].sensor);
    EXPECT_NEAR(scans[i].stamp_s - scans[0].stamp_s, expected[i].stamp_s - expected[0].stamp_s, 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Bags, ScansInBag,
    ::testing::ValuesIn<Written>({{"a.bag", "", true},
                                  {"a.bag", "packing=bz2 poses=odometry", true},
                                  {"a.bag", "packing=lz4 poses=pose depth=mono16", true},
                                  {"a.bag", "depth=32FC1 chunk=100 poses=chain", true},
                                  {"a.bag", "depth=big", true},
                                  {"a.bag", "depth=png", true},
                                  {"a.db3", "", true},
                                  {"a.db3", "poses=odometry depth=32FC1", true},
                                  {"a.db3", "poses=pose depth=compressedDepth", true},
                                  {"a.db3", "poses=chain depth=big", true},
                                  {"a.mcap", "", true},
                                  {"a.mcap", "chunk=0 poses=odometry", true},
                                  {"a.mcap", "packing=zstd poses=pose depth=big", true},
                                  {"a.mcap", "packing=lz4 chunk=100 poses=chain depth=mono16", true},
                                  {"a.mcap", "packing=zstd depth=compressedDepth", true},
                                  {"a.bag", "", false},
                                  {"a.bag", "cloud=doubles packing=lz4", false},
                                  {"a.bag", "cloud=padded", false},
                                  {"a.bag", "cloud=organised", false},
                                  {"a.bag", "cloud=big", false},
                                  {"a.db3", "", false},
                                  {"a.db3", "cloud=doubles", false},
                                  {"a.db3", "cloud=padded", false},
                                  {"a.mcap", "cloud=big", false},
                                  {"a.mcap", "packing=zstd cloud=organised", false}}),
    name_of);

TEST_F(BagFiles, AFolderWithMetadataIsOneRecordingOfItsFiles) {
  const fs::path first = write_clouds("first"), second = write_clouds("second");
  write_bag(first, "walk/walk_0.mcap");
  write_bag(second, "walk/walk_1.mcap", "poses=tf packing=lz4");
  write("walk/metadata.yaml", "rosbag2_bagfile_information:\n");
  const auto source = open_scans({folder / "walk"});
  EXPECT_EQ(source->size(), 6U);
  EXPECT_EQ(read_all(*source).size(), 6U);
  EXPECT_THAT(source->notes(),
              ElementsAre(says("scans: 6 messages of /lidar/points"), says("poses: tf of lidar in map")));
}

TEST_F(BagFiles, PosesAndIntrinsicsOfAFileWin) {
  ScanSourceOptions options = with_poses(write("line.txt", "0 0 1 0 0 0 1\n0 0 2 0 0 0 1\n0 0 3 0 0 0 1\n"));
  options.intrinsics = write("k.txt", "10 10 0 0\n");
  const auto scans = read_all({write_bag(write_images(), "a.bag")}, options);
  ASSERT_EQ(scans.size(), 3U);
  EXPECT_EQ(scans[0].points[0], Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(scans[2].T_map_sensor.translation().z(), 3);
}

}  // namespace
}  // namespace octosurf::test
