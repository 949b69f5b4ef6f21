#include "io/map_file/failing_calls.hpp"

#include <atomic>
#include <cerrno>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
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

}  // namespace

void fail_call_after(std::size_t n, int error) {
  error_number = error;
  struck = false;
  calls_left = static_cast<long>(n);
}

bool stop_failing_calls() {
  calls_left = -1;
  return struck;
}

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
