// Damaged, foreign and hostile bags: an Error(data) or the scans of the undamaged one, never anything worse.
#include "io/readers/bag_files.hpp"
#include "support/seed.hpp"

#include <cstring>
#include <gmock/gmock.h>
#include <random>
#include <zstd.h>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

struct Kind {
  const char* file;
  const char* options;
  bool checked;  ///< every byte of its messages is under a check sum
};
std::string kind_name(const ::testing::TestParamInfo<Kind>& info) {
  std::string name = std::string(info.param.file) + "_" + info.param.options;
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return name;
}

class DamagedBags : public BagFiles, public ::testing::WithParamInterface<Kind> {
 protected:
  void SetUp() override {
    BagFiles::SetUp();
    if (IsSkipped()) return;
    good_ = content(write_bag(write_images(), GetParam().file, GetParam().options));
    expected_ = read_all({folder / GetParam().file});
    ASSERT_EQ(expected_.size(), 3U);
  }

  static std::string content(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  static bool same(const Scan& a, const Scan& b) {
    return a.points.size() == b.points.size() && a.T_map_sensor.matrix() == b.T_map_sensor.matrix() &&
           std::memcmp(a.points.data(), b.points.data(), sizeof(Eigen::Vector3f) * a.points.size()) == 0;
  }

  /// The error, or "same" or "other" scans.
  std::string reading(const std::string& bytes) const {
    const fs::path file = write(GetParam().file, bytes);
    try {
      const auto scans = read_all({file});
      bool all = scans.size() == expected_.size();
      for (std::size_t i = 0; all && i < scans.size(); ++i) all = same(scans[i], expected_[i]);
      return all ? "same" : "other";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::data) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(file.filename().string()));
      return error.what();
    }
  }

  std::string good_;
  std::vector<Scan> expected_;
};

TEST_P(DamagedBags, TruncatedAnywhere) {
  const std::size_t step = good_.size() / 300 + 1;
  for (std::size_t n = 0; n < good_.size(); n += n < 40 || n + 40 > good_.size() ? 1 : step)
    EXPECT_NE(reading(good_.substr(0, n)), "other") << "of " << good_.size() << " bytes the first " << n;
}

TEST_P(DamagedBags, WithSkipBadWhatIsWholeIsThere) {
  ScanSourceOptions options;
  options.skip_bad = true;
  const fs::path file = write(GetParam().file, good_.substr(0, good_.size() * 3 / 4));
  const auto source = [&]() -> std::unique_ptr<ScanSource> {
    try {
      return open_scans({file}, options);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.filename().string()));
      return nullptr;
    }
  }();
  if (!source) return;  // what is whole holds no scan
  const auto scans = read_all(*source);
  EXPECT_FALSE(source->skipped().empty());
  ASSERT_LE(scans.size(), expected_.size());
  for (std::size_t i = 0; i < scans.size(); ++i) EXPECT_TRUE(same(scans[i], expected_[i])) << i;
}

TEST_P(DamagedBags, FlippedBytes) {
  auto random = rng();
  std::size_t same_scans = 0, refused = 0;
  const std::size_t step = good_.size() / 1500 + 1;
  for (std::size_t at = random() % step; at < good_.size(); at += step) {
    std::string bad = good_;
    bad[at] = static_cast<char>(bad[at] ^ static_cast<char>(1 + random() % 255));
    const std::string outcome = reading(bad);
    same_scans += outcome == "same";
    refused += outcome != "same" && outcome != "other";
    // Without check sums nobody can tell a pixel from another.
    if (GetParam().checked) {
      EXPECT_NE(outcome, "other") << "byte " << at;
    }
  }
  EXPECT_GT(refused, 0U);
  EXPECT_GT(same_scans + refused, 0U);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, DamagedBags,
    ::testing::Values(Kind{"a.mcap", "packing=zstd", true}, Kind{"b.mcap", "packing=none chunk=300", true},
                      Kind{"c.mcap", "packing=lz4", true}, Kind{"d.mcap", "chunk=0", true},
                      Kind{"a.db3", "", false}, Kind{"a.bag", "", false},
                      Kind{"b.bag", "packing=bz2 chunk=300", false}, Kind{"c.bag", "packing=lz4", false}),
    kind_name);

/// The head of a ROS 1 bag says where its index is, once there is one; until then, zero.
TEST_F(BagFiles, ABagWithoutIndexIsRead) {
  const fs::path file = write_bag(write_images(), "a.bag", "chunk=300");
  const auto whole = read_all({file});
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const std::size_t place = bytes.find("index_pos=") + std::strlen("index_pos=");
  std::uint64_t index = 0;
  std::memcpy(&index, bytes.data() + place, sizeof index);
  ASSERT_LT(index, bytes.size());
  bytes.replace(place, sizeof index, sizeof index, '\0');
  const auto active = read_all({write("a.bag.active", std::string_view(bytes).substr(0, index))});
  ASSERT_EQ(active.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(active[i].points, whole[i].points);
    EXPECT_EQ(active[i].T_map_sensor.matrix(), whole[i].T_map_sensor.matrix());
  }
}

class ForgedBags : public ScanFiles {};

TEST_F(ForgedBags, AChunkThatUnpacksToFarTooMuch) {
  std::string zeros(std::size_t{100} << 20, '\0'), packed(ZSTD_compressBound(zeros.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), zeros.data(), zeros.size(), 1));
  const auto chunk = [&](std::uint64_t size) {
    return "\x89MCAP0\r\n" +
           test::mcap_record(6, bytes_of(std::uint64_t{0}, std::uint64_t{0}, size, std::uint32_t{0}) +
                                    bytes_of(std::uint32_t{4}) + "zstd" +
                                    bytes_of(std::uint64_t{packed.size()}) + packed);
  };
  EXPECT_THAT(failure({write("a.mcap", chunk(zeros.size()))}), HasSubstr("far more than the file's size"));
  EXPECT_THAT(failure({write("a.mcap", chunk(std::uint64_t{1} << 60))}),
              HasSubstr("far more than the file's size"));
  EXPECT_THAT(failure({write("a.mcap", chunk(1000))}), HasSubstr("zstd says"));
}

TEST_F(ForgedBags, AnUnknownCompression) {
  const std::string chunk =
      test::mcap_record(6, bytes_of(std::uint64_t{0}, std::uint64_t{0}, std::uint64_t{3}, std::uint32_t{0}) +
                               bytes_of(std::uint32_t{3}) + "rar" + bytes_of(std::uint64_t{3}) + "abc");
  EXPECT_THAT(failure({write("a.mcap", "\x89MCAP0\r\n" + chunk)}),
              HasSubstr("compressed as 'rar', which is not read"));
}

TEST_F(ForgedBags, Foreign) {
  EXPECT_THAT(failure({write("a.mcap", "")}), HasSubstr("is empty"));
  EXPECT_THAT(failure({write("a.bag", "something else")}), HasSubstr("no bag"));
  EXPECT_THAT(failure({write("a.bag", "#ROSBAG V1.2\n")}),
              AllOf(HasSubstr("version before 2.0"), HasSubstr("rosbag migrate")));
  EXPECT_THAT(failure({write("a.db3", std::string("SQLite format 3\0", 16) + std::string(4096, 'x'))}),
              HasSubstr("SQLite says"));
}

TEST_F(ForgedBags, AFolderOfCompressedFilesSaysHowToUnpackThem) {
  write("walk/metadata.yaml", "");
  write("walk/walk_0.db3.zstd", "");
  EXPECT_THAT(failure({folder / "walk"}), AllOf(HasSubstr("compressed as a file"), HasSubstr("zstd -d")));
  fs::remove(folder / "walk/walk_0.db3.zstd");
  EXPECT_THAT(failure({folder / "walk"}), HasSubstr("holds no scans"));
}

}  // namespace
}  // namespace octosurf::test
