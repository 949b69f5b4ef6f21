#pragma once

#include "support/paths.hpp"

#include <csignal>
#include <filesystem>
#include <functional>
#include <string>
#include <sys/types.h>
#include <vector>

namespace octosurf::test {

/// The built `octosurf`, or another program, at work beside the test, in `folder`; killed if it is still
/// there in the end.
class Running {
 public:
  Running(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
          const std::string& program = paths::command());
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running();

  void send(int signal) const { ::kill(child_, signal); }
  /// False if it has ended.
  bool runs();
  /// Until `holds` or it has ended; asks every tenth of a millisecond. Returns whether it holds.
  bool wait_until(const std::function<bool()>& holds);
  /// Its exit code, or 128 + the signal that ended it.
  int wait();
  std::string errors() const;  ///< its stderr so far

 private:
  std::filesystem::path errors_;
  pid_t child_ = 0;
  int status_ = 0;
  bool ended_ = false;
};

}  // namespace octosurf::test
