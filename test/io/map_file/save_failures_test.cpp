// Whatever fails while a map is saved, what loads afterwards is the map of before or the new one.
#include "io/map_file/failing_calls.hpp"
#include "io/new_file.hpp"
#include "map_files.hpp"
#include "support/full_disk.hpp"

#include <cerrno>
#include <cstring>
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Voxels so large that the files are a few thousand bytes.
Parameters very_coarse() {
  Parameters parameters;
  parameters.occupancy.resolution = 0.2;
  return parameters;
}

class SaveFails : public MapFiles {
 protected:
  SaveFails() {
    save_map(before, stem);
    surfaces = read_file(stem.string() + ".surfaces");
    bt = read_file(stem.string() + ".bt");
    save_map(after, folder / "new");
  }

  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
  }
  bool nothing_changed() const {
    return read_file(stem.string() + ".surfaces") == surfaces && read_file(stem.string() + ".bt") == bt &&
           files() == 4;
  }
  std::uintmax_t new_size(const char* ending) const {
    return fs::file_size((folder / "new").string() + ending);
  }

  Map before = map_of(changing_room(3), very_coarse()), after = map_of(changing_room(5), very_coarse());
  fs::path stem = folder / "map";
  std::string surfaces, bt;
};

TEST_F(SaveFails, AtEveryByteOfItsFilesAndKeepsWhatWasThere) {
  const std::uintmax_t largest = std::max(new_size(".bt"), new_size(".surfaces"));
  for (std::uintmax_t bytes = 0; bytes < largest; ++bytes) {
    std::string message;
    {
      const FullDisk full(bytes);
      message = failure(Error::Kind::output, [&] { save_map(after, stem); });
    }
    ASSERT_THAT(message, HasSubstr("cannot be written: File too large")) << bytes;
    ASSERT_TRUE(nothing_changed()) << bytes;
  }
  const FullDisk large_enough(largest);
  save_map(after, stem);
  EXPECT_EQ(read_file(stem.string() + ".surfaces"), read_file(folder / "new.surfaces"));
}

TEST_F(SaveFails, AtEverySystemCallAndWhatLoadsIsWhole) {
  std::size_t refused = 0, warned = 0;
  for (std::size_t n = 0;; ++n) {
    save_map(before, stem);
    std::string message;
    fail_call_after(n, EIO);
    try {
      save_map(after, stem);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::output);
      message = error.what();
    }
    if (!stop_failing_calls()) {  // as many as there are
      EXPECT_EQ(message, "");
      break;
    }
    EXPECT_THAT(message, AnyOf(HasSubstr("Input/output error"), IsEmpty())) << "call " << n;
    refused += !message.empty();
    const LoadedMap loaded = load_map(stem);
    EXPECT_TRUE(difference(loaded.map, before).empty() || difference(loaded.map, after).empty())
        << "call " << n;
    warned += !loaded.warning.empty();
    EXPECT_EQ(files(), 4U) << "a temporary file is left; call " << n;
  }
  EXPECT_GE(refused, 7U) << "two files written, synced and renamed, and their folder synced";
  EXPECT_LE(warned, 2U) << "only between the two renames a .bt is not the map's own";
}

TEST_F(SaveFails, InAFolderThatOneMayNotWriteTo) {
  fs::permissions(folder, fs::perms::owner_read | fs::perms::owner_exec | fs::perms::group_read |
                              fs::perms::group_exec | fs::perms::others_read | fs::perms::others_exec);
  const pid_t child = fork();
  if (child == 0) {
    constexpr uid_t nobody = 65534;
    if (::geteuid() == 0 && ::setuid(nobody) != 0) _exit(2);  // root may write anywhere
    try {
      save_map(after, stem);
    } catch (const Error& error) {
      _exit(std::strstr(error.what(), "Permission denied") != nullptr ? 0 : 3);
    }
    _exit(4);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  fs::permissions(folder, fs::perms::owner_all);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "cannot become nobody";
  EXPECT_EQ(WEXITSTATUS(status), 0) << "3: another message, 4: it was saved";
  EXPECT_TRUE(nothing_changed());
}

/// In a process with a disk of its own of a few blocks.
TEST_F(SaveFails, OnADiskThatIsFull) {
  const fs::path disk = folder / "disk";
  fs::create_directory(disk);
  const pid_t child = fork();
  if (child == 0) {
    if (::unshare(CLONE_NEWNS) != 0 || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0)
      _exit(2);
    try {
      save_map(before, disk / "map");
      const std::string kept = read_file(disk / "map.surfaces");
      std::string filler;
      for (std::size_t blocks = 16; blocks > 0; --blocks) {
        std::error_code ignored;
        if (fs::space(disk, ignored).available < 4096) break;
        write_file(disk / ("filler" + std::to_string(blocks)), std::string(4096, 'x'));
      }
      try {
        save_map(after, disk / "map");
        _exit(3);
      } catch (const Error& error) {
        if (std::strstr(error.what(), "No space left on device") == nullptr) _exit(4);
      }
      if (read_file(disk / "map.surfaces") != kept || !difference(load_map(disk / "map").map, before).empty())
        _exit(5);
    } catch (const std::exception&) {
      _exit(6);
    }
    _exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "may not mount a disk";
  EXPECT_EQ(WEXITSTATUS(status), 0)
      << "3: it was saved, 4: another message, 5: what was there is not, 6: too small a disk to begin with";
}

}  // namespace
}  // namespace octosurf::test
