// Files that are complete or not there, in folders where others write, too.
#include "io/new_file.hpp"

#include "map_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class NewFiles : public MapFiles {
 protected:
  fs::path file = folder / "f";
  const std::string part = (folder / "f").string() + ".part-";

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

TEST_F(NewFiles, AreWrittenBesideTheirPlaceUnderANameOfTheirOwn) {
  io::NewFile one(file, false), two(file, false);
  write_text(one, "one");
  write_text(two, "two");
  EXPECT_NE(one.temporary(), two.temporary());
  EXPECT_THAT(one.temporary().filename().string(), MatchesRegex("f\\.part-[0-9a-f]+"));
  EXPECT_EQ(one.temporary().parent_path(), folder);
  EXPECT_FALSE(fs::exists(file));
  one.commit();
  EXPECT_EQ(read_file(file), "one");
  EXPECT_THAT(failure(Error::Kind::usage, [&] { two.commit(); }), HasSubstr("exists already"))
      << "it has come meanwhile";
  EXPECT_EQ(read_file(file), "one");
}

TEST_F(NewFiles, TemporaryFilesAreNotOpenedThroughLinks) {
  write_file(folder / "precious", "precious");
  // Until then the name could be told beforehand.
  fs::create_symlink(folder / "precious", folder / ("f.part-" + std::to_string(::getpid())));
  fs::create_symlink(folder / "precious", part + "0123456789abcdef");
  replace("new");
  EXPECT_EQ(read_file(folder / "precious"), "precious");
  EXPECT_EQ(read_file(file), "new");
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

/// Another process that has written a temporary file of `target` and waits until it is told to go on.
class Writer {
 public:
  explicit Writer(const fs::path& target) {
    if (::pipe(told_.data()) != 0 || ::pipe(ready_.data()) != 0) throw std::runtime_error("no pipe");
    child_ = fork();
    if (child_ == 0) {
      io::NewFile file(target, true);
      file.write([](std::ostream& out) { out << "of the other"; });
      char byte = 'r';
      if (::write(ready_[1], &byte, 1) != 1 || ::read(told_[0], &byte, 1) != 1) _exit(1);
      file.commit();
      _exit(0);
    }
    char byte = 0;
    if (::read(ready_[0], &byte, 1) != 1) throw std::runtime_error("the writer did not start");
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() {
    if (child_ > 0) kill();
    for (const int end : {told_[0], told_[1], ready_[0], ready_[1]}) ::close(end);
  }

  void kill() {
    ::kill(child_, SIGKILL);
    wait();
  }
  /// Its exit code.
  int go_on() {
    const char byte = 'g';
    return ::write(told_[1], &byte, 1) == 1 ? wait() : -1;
  }

 private:
  int wait() {
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::array<int, 2> told_{}, ready_{};
  pid_t child_ = 0;
};

std::vector<fs::path> parts_in(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().string().find(".part-") != std::string::npos) found.push_back(entry.path());
  return found;
}

TEST_F(NewFiles, WhatAKilledProcessLeavesIsRemoved) {
  Writer(file).kill();
  ASSERT_EQ(parts_in(folder).size(), 1U) << "what a kill leaves";
  write_file(folder / "other", "");
  {
    io::NewFile other(folder / "other", true);
    write_text(other, "x");
    EXPECT_EQ(parts_in(folder).size(), 2U) << "another file's parts are left alone";
  }
  replace("new");
  EXPECT_TRUE(parts_in(folder).empty());
  EXPECT_EQ(read_file(file), "new");
}

TEST_F(NewFiles, WhatAProcessStillWritesIsNotRemoved) {
  Writer other(file);
  ASSERT_EQ(parts_in(folder).size(), 1U);
  replace("new");
  EXPECT_EQ(parts_in(folder).size(), 1U);
  EXPECT_EQ(other.go_on(), 0);
  EXPECT_EQ(read_file(file), "of the other");
  EXPECT_TRUE(parts_in(folder).empty());
}

TEST_F(NewFiles, WhatOnlyLooksLikeALeftOverStays) {
  const std::string name = part + "0123456789abcde";
  write_file(name, "a digit short");
  write_file(name + "F", "not a hexadecimal digit of ours");
  write_file(name + "f0", "a digit more");
  fs::create_directory(name + "0");
  fs::create_symlink(folder / "nowhere", name + "1");
  write_file(name + "2", "with a second name");
  fs::create_hard_link(name + "2", folder / "second");
  ASSERT_EQ(::mkfifo((name + "3").c_str(), 0600), 0);
  write_file(folder / "g.part-0123456789abcdef", "another's");
  const std::size_t before = parts_in(folder).size();
  if (::geteuid() == 0) {
    write_file(name + "4", "of another user");
    ASSERT_EQ(::chown((name + "4").c_str(), 65534, 65534), 0);
  }
  write_file(name + "5", "left over");
  replace("new");
  EXPECT_EQ(parts_in(folder).size(), before + (::geteuid() == 0 ? 1 : 0));
  EXPECT_FALSE(fs::exists(name + "5"));
}

}  // namespace
}  // namespace octosurf::test
