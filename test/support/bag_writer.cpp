#include "support/bag_writer.hpp"

#include "support/paths.hpp"

#include <cstdio>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace octosurf::test {
namespace {

/// write_bag.py at the other end of two pipes.
class BagWriter {
 public:
  BagWriter() {
    int to[2], from[2];
    if (::pipe2(to, O_CLOEXEC) != 0 || ::pipe2(from, O_CLOEXEC) != 0) return;
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(to[0], 0);
      ::dup2(from[1], 1);
      const std::string python = paths::bag_python(),
                        script = paths::source() + "/test/io/readers/write_bag.py";
      ::execlp(python.c_str(), python.c_str(), "-B", script.c_str(), nullptr);
      ::_exit(127);
    }
    ::close(to[0]);
    ::close(from[1]);
    requests_ = ::fdopen(to[1], "w");
    answers_ = ::fdopen(from[0], "r");
    ready_ = answer() == "ready\n";
  }
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;
  ~BagWriter() {
    if (requests_ != nullptr) std::fclose(requests_);
    if (answers_ != nullptr) std::fclose(answers_);
    if (child_ > 0) ::waitpid(child_, nullptr, 0);
  }

  bool ready() const { return ready_; }
  std::string ask(const std::string& request) {
    std::fputs((request + "\n").c_str(), requests_);
    std::fflush(requests_);
    return answer();
  }

 private:
  std::string answer() {
    char line[1024];
    return std::fgets(line, sizeof line, answers_) != nullptr ? line : "";
  }

  pid_t child_ = 0;
  std::FILE* requests_ = nullptr;
  std::FILE* answers_ = nullptr;
  bool ready_ = false;
};

BagWriter& writer() {
  static BagWriter only;
  return only;
}

}  // namespace

bool can_write_bags() { return writer().ready(); }

void write_bag_of(const std::filesystem::path& recording, const std::filesystem::path& bag,
                  const std::string& options) {
  const std::string request = recording.string() + "\t" + bag.string() + "\t" + options;
  EXPECT_EQ(writer().ask(request), "written\n") << request;
}

}  // namespace octosurf::test
