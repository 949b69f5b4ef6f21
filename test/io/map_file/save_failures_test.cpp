// Whatever fails while a map is saved, what loads afterwards is the map of before or the new one.
#include "io/new_file.hpp"
#include "map_files.hpp"

#include <cerrno>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace octosurf::test {
namespace {

std::atomic<long> calls_left{-1};  // negative: none fails
std::atomic<bool> struck{false};
int error_number = 0;

/// True if this call has to fail; errno is set then.
bool fails() {
  if (calls_left < 0 || calls_left-- > 0) return false;
  struck = true;
  errno = error_number;
  return true;
}

long call(long number, auto... arguments) { return fails() ? -1 : ::syscall(number, arguments...); }

/// The call after `n` more of them fails with `error`: only that one.
void fail_call_after(std::size_t n, int error) {
  error_number = error;
  struck = false;
  calls_left = static_cast<long>(n);
}

/// No further call fails. Returns whether one has, since fail_call_after().
bool stop_failing_calls() {
  calls_left = -1;
  return struck;
}

/// Voxels so large that the files are few thousand bytes.
const Parameters very_coarse = test::of_voxels(0.5);

class SaveFails : public MapFiles {
 protected:
  Map before = map_of(changing_room(3), very_coarse), after = map_of(changing_room(5), very_coarse);
  fs::path stem = folder / "map";
};

/// That a disk may be full at any byte is ExportTest.FullDiskIsAnErrorAndLeavesNothing's: both write
/// NewFiles.
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
    EXPECT_EQ(count_files(), 2U) << "a temporary file is left; call " << n;
  }
  EXPECT_GE(refused, 7U) << "two files written, synced and renamed, and their folder synced";
  EXPECT_LE(warned, 2U) << "only between the two renames a .bt is not the map's own";
}

class NewFiles : public MapFiles {
 protected:
  fs::path file = folder / "f";
  const fs::path part = folder / "f.part";

  static void write_text(io::NewFile& to, const std::string& text) {
    to.write([&](std::ostream& out) { out << text; });
  }
  void replace(const std::string& text) const {
    io::NewFile next(file, true);
    write_text(next, text);
    next.commit();
  }
  static mode_t mode_of(const fs::path& path) {
    struct stat found {};
    ::stat(path.c_str(), &found);
    return found.st_mode & 07777;
  }
};

TEST_F(NewFiles, AreWrittenBesideTheirPlace) {
  io::NewFile one(file, false);
  write_text(one, "one");
  EXPECT_EQ(one.temporary(), part);
  EXPECT_FALSE(fs::exists(file));
  write_file(file, "another's");
  EXPECT_THAT(failure(Error::Kind::usage, [&] { one.commit(); }), HasSubstr("exists already"))
      << "it has come meanwhile";
  EXPECT_EQ(read_file(file), "another's");
}

TEST_F(NewFiles, OfTwoWritersTheFirstFails) {
  {
    io::NewFile one(file, true), two(file, true);
    write_text(one, "one");
    write_text(two, "two");
    EXPECT_THAT(failure(Error::Kind::output, [&] { one.commit(); }), HasSubstr("by another, too"));
    two.commit();
  }
  EXPECT_EQ(read_file(file), "two");
  EXPECT_FALSE(fs::exists(part));
}

TEST_F(NewFiles, WhatHasTheTemporaryNameIsReplacedNotOpened) {
  write_file(folder / "precious", "precious");
  fs::create_symlink(folder / "precious", part);
  replace("new");
  EXPECT_EQ(read_file(folder / "precious"), "precious");
  EXPECT_EQ(read_file(file), "new");
  write_file(part, "left by a killed process");
  replace("newer");
  EXPECT_EQ(read_file(file), "newer");
  EXPECT_FALSE(fs::exists(part));
}

TEST_F(NewFiles, ALinkInTheirPlaceIsReplacedNotFollowed) {
  write_file(folder / "precious", "precious");
  fs::create_symlink(folder / "precious", file);
  EXPECT_THAT(failure(Error::Kind::usage, [&] { io::NewFile(file, false); }), HasSubstr("exists already"));
  replace("new");
  EXPECT_EQ(read_file(folder / "precious"), "precious");
  EXPECT_FALSE(fs::is_symlink(file));
  fs::remove(file);
  fs::create_symlink(folder / "nowhere", file);
  EXPECT_THAT(failure(Error::Kind::usage, [&] { io::NewFile(file, false); }), HasSubstr("exists already"));
}

TEST_F(NewFiles, DevicesAndPipesAreNotReplaced) {
  EXPECT_THAT(failure(Error::Kind::output, [] { io::NewFile("/dev/null", true); }), HasSubstr("/dev/null"));
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_THAT(failure(Error::Kind::output, [&] { io::NewFile(file, true); }), HasSubstr("not a file"));
}

TEST_F(NewFiles, KeepTheAccessRightsOfWhatTheyReplace) {
  const mode_t usual = ::umask(027);
  replace("first");
  EXPECT_EQ(mode_of(file), 0640U) << "as any new file";
  for (const mode_t mode : {0600U, 0664U, 0444U}) {
    ASSERT_EQ(::chmod(file.c_str(), mode), 0);
    io::NewFile next(file, true);
    write_text(next, "next");
    EXPECT_EQ(mode_of(next.temporary()), 0600U) << "nobody else reads what is not yet in place";
    next.commit();
    EXPECT_EQ(mode_of(file), mode);
  }
  ::umask(usual);
}

}  // namespace
}  // namespace octosurf::test

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name): libc's functions, replaced.
extern "C" {
ssize_t write(int file, const void* bytes, size_t count) {
  return octosurf::test::call(SYS_write, file, bytes, count);
}
int fsync(int file) { return static_cast<int>(octosurf::test::call(SYS_fsync, file)); }
int fchmod(int file, mode_t mode) noexcept {
  return static_cast<int>(octosurf::test::call(SYS_fchmod, file, mode));
}
int rename(const char* from, const char* to) noexcept {
  return static_cast<int>(octosurf::test::call(SYS_renameat2, -100, from, -100, to, 0U));
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  return static_cast<int>(octosurf::test::call(SYS_renameat2, from_folder, from, to_folder, to, flags));
}
}
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
