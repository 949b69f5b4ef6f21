// Files that are complete or not there, in folders where others write, too.
#include "io/new_file.hpp"

#include "map_files.hpp"

#include <sys/stat.h>
#include <unistd.h>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

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
