#include "io/new_file.hpp"

#include <algorithm>
#include <cerrno>
#include <ext/stdio_filebuf.h>
#include <fcntl.h>
#include <string>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

/// 0, or errno. EINVAL and ENOTSUP mean that the file system needs no sync.
int sync_failure(int descriptor) {
  if (::fsync(descriptor) == 0 || errno == EINVAL || errno == ENOTSUP) return 0;
  return errno;
}

constexpr const char* not_written = "cannot be written";
constexpr const char* not_synced = "may not have reached the disk";
constexpr const char* part_ending = ".part";

}  // namespace

void fail_to_write(const fs::path& file, const std::string& what, int failure) {
  const bool no_more_files = failure == EMFILE || failure == ENFILE;
  throw Error(Error::Kind::output, file.string(), what + ": " + std::generic_category().message(failure),
              no_more_files ? "raise the limit of open files (ulimit -n)"
                            : "check the folder, its rights and the space left");
}

bool is_at(int descriptor, const fs::path& path) {
  struct stat opened {
  }, named{};
  return ::fstat(descriptor, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return ending;
}

bool is_part(const fs::path& file) { return file.extension() == part_ending; }

fs::path file_of_map(fs::path stem, const char* ending) {
  if (stem.extension() == ".surfaces" || stem.extension() == ".bt") stem.replace_extension();
  stem += ending;
  return stem;
}

void require_map_name(const fs::path& stem) {
  const fs::path name = file_of_map(stem, "").filename();
  if (name.empty() || name == "." || name == "..")
    throw Error(Error::Kind::usage, stem.string(), "names no map", "give its path, as in maps/office");
}

void sync(const fs::path& path) {
  const fs::path there = path.empty() ? "." : path;
  const int descriptor = ::open(there.c_str(), O_RDONLY | O_CLOEXEC);
  const int failure = descriptor < 0 ? errno : sync_failure(descriptor);
  if (descriptor >= 0) ::close(descriptor);
  if (failure != 0) fail_to_write(there, not_synced, failure);
}

NewFile::NewFile(fs::path file, bool force)
    : file_(std::move(file)), temporary_(file_.string() + part_ending), force_(force) {
  std::error_code ignored;
  const fs::file_status there = fs::status(file_, ignored);
  if (fs::is_directory(there))
    throw Error(Error::Kind::output, file_.string(), "is a folder", "give a file name");
  if (fs::exists(there) && !fs::is_regular_file(there))
    throw Error(Error::Kind::output, file_.string(), "is not a file that can be replaced",
                "give another file name");
  if (fs::is_symlink(file_, ignored))
    throw Error(Error::Kind::output, file_.string(), "is a symbolic link, which is not followed",
                "name the file " + fs::read_symlink(file_, ignored).string());
  if (fs::exists(there) && (there.permissions() & fs::perms::owner_write) == fs::perms::none)
    throw Error(Error::Kind::output, file_.string(), "is read-only", "chmod u+w, or give another name");
  if (!force && fs::exists(there))
    throw Error(Error::Kind::usage, file_.string(), "exists already", "--force overwrites it");
}

NewFile::~NewFile() {
  if (descriptor_ < 0) return;
  if (!committed_ && is_at(descriptor_, temporary_)) ::unlink(temporary_.c_str());
  ::close(descriptor_);
}

void NewFile::create() {
  ::unlink(temporary_.c_str());
  std::error_code ignored;
  // Accessible to the owner only until commit() sets the permissions of the file it replaces.
  descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                       fs::exists(file_, ignored) ? 0600 : 0666);
  if (descriptor_ < 0) fail_to_write(file_, not_written, errno);
}

void NewFile::write(const std::function<void(std::ostream&)>& fill) {
  create();
  const int descriptor = ::dup(descriptor_);
  if (descriptor < 0) fail_to_write(file_, not_written, errno);
  __gnu_cxx::stdio_filebuf<char> buffer(descriptor, std::ios::out | std::ios::binary, 65536);
  std::ostream stream(&buffer);
  stream.exceptions(std::ios::badbit);  // at once, while errno says why
  try {
    fill(stream);
    stream.flush();
  } catch (const std::ios::failure&) {
    fail_to_write(file_, not_written, errno);
  }
}

void NewFile::sync() const {
  if (const int failure = sync_failure(descriptor_); failure != 0) fail_to_write(file_, not_synced, failure);
}

void NewFile::commit() {
  sync();
  if (!is_at(descriptor_, temporary_))
    throw Error(Error::Kind::output, file_.string(), "is being written by another, too",
                "give each its own file");
  struct stat replaced {};
  if (::stat(file_.c_str(), &replaced) == 0) ::fchmod(descriptor_, replaced.st_mode & 0777);
  if (!force_ && ::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, file_.c_str(), RENAME_NOREPLACE) == 0) {
    committed_ = true;
    return;
  }
  if (!force_ && errno == EEXIST)
    throw Error(Error::Kind::usage, file_.string(), "exists already", "--force overwrites it");
  if (::rename(temporary_.c_str(), file_.c_str()) != 0) fail_to_write(file_, "cannot be put in place", errno);
  committed_ = true;
}

void write_file(const fs::path& file, bool force, const std::function<void(std::ostream&)>& fill) {
  NewFile out(file, force);
  out.write(fill);
  out.commit();
}

}  // namespace octosurf::io
