// Damaged, foreign and hostile bags; every byte of some is test/fuzz's.
#include "io/readers/bag_files.hpp"

#include <cstdlib>
#include <zstd.h>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;

class DamagedBags : public BagFiles, public ::testing::WithParamInterface<const char*> {};

TEST_P(DamagedBags, WithSkipBadWhatIsWholeIsThere) {
  const fs::path file = write_bag(write_images(), GetParam(), "chunk=300");
  std::vector<Scan> whole = read_all({file});
  ASSERT_EQ(whole.size(), 3U);
  fs::resize_file(file, fs::file_size(file) / 2);
  std::unique_ptr<ScanSource> source;
  try {
    source = open_scans({file}, {.skip_bad = true});
  } catch (const Error& error) {  // what is whole holds no scan
    EXPECT_THAT(error.what(), says(file.filename().string()));
    return;
  }
  const auto scans = read_all(*source);
  EXPECT_FALSE(source->skipped().empty());
  ASSERT_LE(scans.size(), whole.size());
  whole.resize(scans.size());
  expect_same_scans(scans, whole);
}

INSTANTIATE_TEST_SUITE_P(Kinds, DamagedBags, ::testing::Values("a.mcap", "a.db3", "a.bag"));

/// The head of a ROS 1 bag says where its index is, once there is one; until then, zero.
TEST_F(BagFiles, ABagWithoutIndexIsRead) {
  const fs::path file = write_bag(write_images(), "a.bag", "chunk=300");
  const auto whole = read_all({file});
  std::string bytes = read_file(file);
  const std::size_t place = bytes.find("index_pos=") + std::strlen("index_pos=");
  std::uint64_t index = 0;
  std::memcpy(&index, bytes.data() + place, sizeof index);
  ASSERT_LT(index, bytes.size());
  bytes.replace(place, sizeof index, sizeof index, '\0');
  const auto active = read_all({write("a.bag.active", std::string_view(bytes).substr(0, index))});
  expect_same_scans(active, whole);
}

/// SQLite writes the log into the base when the last one closes it; a recorder that was killed did not.
TEST_F(BagFiles, ABaseIsReadWithTheLogBesideIt) {
  const fs::path whole = write_bag(write_images(), "whole.db3"), killed = folder / "killed/a.db3";
  fs::create_directories(killed.parent_path());
  ASSERT_EQ(
      std::system(
          ("python3 -c \"import os, sqlite3; b = sqlite3.connect('" + killed.string() +
           "', isolation_level=None); b.execute('PRAGMA journal_mode=WAL'); "
           "b.execute('PRAGMA wal_autocheckpoint=0'); w = sqlite3.connect('" +
           whole.string() +
           "'); [b.execute(line) for line in w.iterdump() if line not in ('COMMIT;', 'BEGIN TRANSACTION;')]"
           "; os._exit(0)\"")
              .c_str()),
      0);
  ASSERT_TRUE(fs::exists(killed.string() + "-wal"));
  fs::remove(killed.string() + "-shm");
  const auto size = fs::file_size(killed), log_size = fs::file_size(killed.string() + "-wal");
  expect_same_scans(read_all({killed}), read_all({whole}));
  EXPECT_EQ(fs::file_size(killed), size) << "nothing is written";
  EXPECT_EQ(fs::file_size(killed.string() + "-wal"), log_size);
  EXPECT_FALSE(fs::exists(killed.string() + "-shm"));
}

class ForgedBags : public ScanFiles {};

TEST_F(ForgedBags, AChunkThatUnpacksToFarTooMuchOrInAnotherWay) {
  std::string zeros(std::size_t{100} << 20, '\0'), packed(ZSTD_compressBound(zeros.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), zeros.data(), zeros.size(), 1));
  const auto refused = [&](std::uint64_t size, const std::string& how, const std::string& bytes) {
    return failure({write(
        "a.mcap", "\x89MCAP0\r\n" +
                      mcap_record(6, bytes_of(std::uint64_t{0}, std::uint64_t{0}, size, std::uint32_t{0}) +
                                         bytes_of(static_cast<std::uint32_t>(how.size())) + how +
                                         bytes_of(std::uint64_t{bytes.size()}) + bytes))});
  };
  EXPECT_THAT(refused(zeros.size(), "zstd", packed), says("far more than the file's size"));
  EXPECT_THAT(refused(std::uint64_t{1} << 60, "zstd", packed), says("far more than the file's size"));
  EXPECT_THAT(refused(1000, "zstd", packed), says("zstd says"));
  EXPECT_THAT(refused(3, "rar", "abc"), says("compressed as 'rar', which is not read"));
}

TEST_F(ForgedBags, Foreign) {
  EXPECT_THAT(failure({write("a.mcap", "")}), says("is empty"));
  EXPECT_THAT(failure({write("a.bag", "something else")}), says("no bag"));
  EXPECT_THAT(failure({write("a.bag", "#ROSBAG V1.2\n")}), says("version before 2.0", "rosbag migrate"));
  EXPECT_THAT(failure({write("a.db3", std::string("SQLite format 3\0", 16) + std::string(4096, 'x'))}),
              says("SQLite says"));
}

TEST_F(ForgedBags, AFolderOfCompressedFilesSaysHowToUnpackThem) {
  write("walk/metadata.yaml", "");
  write("walk/walk_0.db3.zstd", "");
  EXPECT_THAT(failure({folder / "walk"}), says("compressed as a file", "zstd -d"));
  fs::remove(folder / "walk/walk_0.db3.zstd");
  EXPECT_THAT(failure({folder / "walk"}), says("holds no scans"));
}

}  // namespace
}  // namespace octosurf::test
