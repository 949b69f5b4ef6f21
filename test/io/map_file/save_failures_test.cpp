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

std::vector<std::string> calls;  // "sync FILE" and "name FILE", by a link or a rename
std::string name_of(int file) {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/fd/" + std::to_string(file), ignored).string();
}

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

/// Whether the file is written anew, or what has changed since it was read. That a disk may be full at any
/// byte is ExportTest.FullDiskIsAnErrorAndLeavesNothing's: both write NewFiles.
class SaveFailsWhile : public SaveFails, public ::testing::WithParamInterface<bool> {};

TEST_P(SaveFailsWhile, AtEverySystemCallAndWhatLoadsIsWhole) {
  const bool in_place = GetParam();
  const std::vector<Scan> scans = changing_room(5);
  std::size_t refused = 0, warned = 0;
  for (std::size_t n = 0;; ++n) {
    save_map(before, stem);
    Mapper mapper(in_place ? load_map(stem).map : Map(very_coarse));
    for (const Scan& scan : scans) mapper.insert(scan);
    std::string message;
    for (const int error : {EIO, ENOSPC}) {
      fail_call_after(n, error);
      try {
        save_map(mapper.map(), stem);
        message.clear();
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), Error::Kind::output);
        message = error.what();
        ++refused;
      }
      if (!struck) break;
      stop_failing_calls();
      EXPECT_THAT(message, AnyOf(HasSubstr("Input/output error"), HasSubstr("No space left"), IsEmpty()))
          << "call " << n;
      const LoadedMap loaded = load_map(stem);
      EXPECT_TRUE(difference(loaded.map, before).empty() || difference(loaded.map, mapper.map()).empty())
          << "call " << n;
      warned += !loaded.warning.empty();
      EXPECT_EQ(count_files(), 2U) << "a temporary file is left; call " << n;
    }
    if (!stop_failing_calls()) {  // as many as there are
      EXPECT_EQ(message, "");
      break;
    }
    save_map(mapper.map(), stem);
    EXPECT_EQ(difference(load_map(stem).map, mapper.map()), "");
  }
  EXPECT_GE(refused, 14U) << "two files written, synced and renamed, and their folder synced";
  EXPECT_LE(warned, 8U) << "only between the two a .bt is older";
}

INSTANTIATE_TEST_SUITE_P(, SaveFailsWhile, ::testing::Bool(),
                         [](const auto& in_place) { return in_place.param ? "InPlace" : "Anew"; });

/// Nor is another's .bt lost, whatever fails.
TEST_F(SaveFails, AtEverySystemCallAndWhatWasSomebodyElsesIsThere) {
  const auto kept = [&] {
    for (const auto& entry : fs::directory_iterator(folder))
      if (read_file(entry.path()) == "somebody else's") return true;
    return false;
  };
  for (std::size_t n = 0;; ++n) {
    for (const auto& entry : fs::directory_iterator(folder)) fs::remove(entry.path());
    write_file(folder / "map.bt", "somebody else's");
    fail_call_after(n, EIO);
    try {
      save_map(after, stem);
    } catch (const Error&) {
    }
    const bool failed = stop_failing_calls();
    EXPECT_TRUE(kept()) << "call " << n;
    for (const auto& entry : fs::directory_iterator(folder)) EXPECT_NE(entry.path().extension(), ".part");
    if (!failed) break;
  }
  EXPECT_EQ(difference(load_map(stem).map, after), "");
}

/// What is kept and its name are on the disk before the other name is the map's.
TEST_F(SaveFails, AfterAPowerCutToo) {
  write_file(folder / "map.bt", "somebody else's");
  calls.clear();
  save_map(after, stem);
  const std::string kept = (folder / "map.edited.bt").string();
  const auto named = std::ranges::find(calls, "name " + kept),
             synced = std::find(named, calls.end(), "sync " + kept),
             folder_synced = std::find(synced, calls.end(), "sync " + folder.string()),
             replaced = std::ranges::find(calls, "name " + (folder / "map.bt").string());
  EXPECT_TRUE(folder_synced < replaced && replaced < calls.end()) << ::testing::PrintToString(calls);
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

/// Neither the link is replaced, which would leave the file it names as it was, nor that file.
TEST_F(NewFiles, ALinkInTheirPlaceIsRefusedByName) {
  write_file(folder / "precious", "precious");
  for (const char* const to : {"precious", "nowhere"}) {
    fs::create_symlink(folder / to, file);
    for (const bool force : {false, true})
      EXPECT_THAT(failure(Error::Kind::output, [&] { io::NewFile(file, force); }),
                  AllOf(HasSubstr(file.string() + ": is a symbolic link"), HasSubstr(to)));
    fs::remove(file);
  }
  EXPECT_EQ(read_file(folder / "precious"), "precious");
}

/// By its mode, as root may write whatever it likes.
TEST_F(NewFiles, WhatIsReadOnlyIsRefusedByName) {
  replace("precious");
  ASSERT_EQ(::chmod(file.c_str(), 0444), 0);
  EXPECT_THAT(failure(Error::Kind::output, [&] { io::NewFile(file, true); }),
              AllOf(HasSubstr(file.string() + ": is read-only"), HasSubstr("chmod u+w")));
  const Map map(coarse());
  save_map(map, folder / "m");
  for (const char* const name : {"m.bt", "m.surfaces"}) {
    ASSERT_EQ(::chmod((folder / name).c_str(), 0444), 0);
    EXPECT_THAT(failure(Error::Kind::output, [&] { save_map(map, folder / "m"); }), HasSubstr(name));
    ASSERT_EQ(::chmod((folder / name).c_str(), 0644), 0);
  }
  save_map(map, folder / "m");
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
  for (const mode_t mode : {0600U, 0664U, 0640U}) {
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
ssize_t pwrite64(int file, const void* bytes, size_t count, off64_t at) {
  return octosurf::test::call(SYS_pwrite64, file, bytes, count, at);
}
int fdatasync(int file) { return static_cast<int>(octosurf::test::call(SYS_fdatasync, file)); }
int ftruncate64(int file, off64_t size) noexcept {
  return static_cast<int>(octosurf::test::call(SYS_ftruncate, file, size));
}
int unlink(const char* path) noexcept { return static_cast<int>(octosurf::test::call(SYS_unlink, path)); }
int fsync(int file) {
  octosurf::test::calls.push_back("sync " + octosurf::test::name_of(file));
  return static_cast<int>(octosurf::test::call(SYS_fsync, file));
}
int fchmod(int file, mode_t mode) noexcept {
  return static_cast<int>(octosurf::test::call(SYS_fchmod, file, mode));
}
int link(const char* from, const char* to) noexcept {
  octosurf::test::calls.push_back(std::string("name ") + to);
  return static_cast<int>(octosurf::test::call(SYS_link, from, to));
}
int rename(const char* from, const char* to) noexcept {
  octosurf::test::calls.push_back(std::string("name ") + to);
  return static_cast<int>(octosurf::test::call(SYS_renameat2, -100, from, -100, to, 0U));
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  octosurf::test::calls.push_back(std::string("name ") + to);
  return static_cast<int>(octosurf::test::call(SYS_renameat2, from_folder, from, to_folder, to, flags));
}
}
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
