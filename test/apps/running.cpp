#include "apps/running.hpp"

#include <chrono>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace octosurf::test {

Running::Running(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                 const std::string& program)
    : errors_(folder / ".running") {
  std::vector<const char*> words{program.c_str()};
  for (const std::string& argument : arguments) words.push_back(argument.c_str());
  words.push_back(nullptr);
  child_ = fork();
  if (child_ < 0) throw std::runtime_error("cannot start a process");
  if (child_ > 0) return;
  const int err = ::open(errors_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int none = ::open("/dev/null", O_RDWR);
  if (err < 0 || none < 0 || ::dup2(none, 0) < 0 || ::dup2(none, 1) < 0 || ::dup2(err, 2) < 0 ||
      ::chdir(folder.c_str()) != 0)
    _exit(126);
  ::execv(words[0], const_cast<char* const*>(words.data()));
  _exit(127);
}

Running::~Running() {
  if (!runs()) return;
  send(SIGKILL);
  wait();
}

bool Running::runs() {
  if (!ended_) ended_ = ::waitpid(child_, &status_, WNOHANG) == child_;
  return !ended_;
}

bool Running::wait_until(const std::function<bool()>& holds) {
  for (;;) {
    const bool still = runs();  // asked first: what it did last counts
    if (holds()) return true;
    if (!still) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

int Running::wait() {
  if (!ended_) ::waitpid(child_, &status_, 0);
  ended_ = true;
  return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
}

std::string Running::errors() const {
  std::ifstream in(errors_, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace octosurf::test
