#include "io/map_file/left_over_files.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fcntl.h>
#include <string_view>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view part = ".part-";
constexpr std::size_t random_digits = 16;

bool is_part_of(const std::string& name, const std::string& file) {
  if (name.size() != file.size() + part.size() + random_digits || !name.starts_with(file + std::string(part)))
    return false;
  return std::all_of(name.end() - random_digits, name.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

/// The open file is a regular file of this user, at `path` and without other links.
bool is_own(int descriptor, const fs::path& path) {
  struct stat opened {
  }, named{};
  return ::fstat(descriptor, &opened) == 0 && S_ISREG(opened.st_mode) && opened.st_uid == ::geteuid() &&
         opened.st_nlink == 1 && ::lstat(path.c_str(), &named) == 0 && named.st_dev == opened.st_dev &&
         named.st_ino == opened.st_ino;
}

void remove_if_left_over(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return;
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0 && is_own(descriptor, path)) ::unlink(path.c_str());
  ::close(descriptor);
}

}  // namespace

std::string new_part_ending() {
  std::uint64_t number = 0;
  if (::getrandom(&number, sizeof number, 0) != sizeof number)
    throw Error(Error::Kind::output, "temporary file", "the system gives no random number for its name");
  std::array<char, random_digits + 1> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(number));
  return std::string(part) + text.data();
}

void remove_left_overs(const fs::path& file) {
  const std::string name = file.filename().string();
  std::error_code failure;
  fs::directory_iterator entry(file.has_parent_path() ? file.parent_path() : ".", failure);
  for (; !failure && entry != fs::directory_iterator(); entry.increment(failure))
    if (is_part_of(entry->path().filename().string(), name)) remove_if_left_over(entry->path());
}

}  // namespace octosurf::io
