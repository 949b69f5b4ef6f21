#include "io/new_file.hpp"

#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <string>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

void sync_path(const std::filesystem::path& path, int flags, const std::filesystem::path& named) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int failure = errno;
  if (descriptor >= 0) ::close(descriptor);
  // EINVAL, ENOTSUP: a file system that has nothing to sync.
  if (synced || failure == EINVAL || failure == ENOTSUP) return;
  throw Error(Error::Kind::output, named.string(),
              "may not have reached the disk: " + std::generic_category().message(failure), "check the disk");
}

}  // namespace

void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  sync_path(folder.empty() ? "." : folder, O_RDONLY | O_DIRECTORY, file);
}

NewFile::NewFile(std::filesystem::path file, bool force) : file_(std::move(file)) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file_, ignored)) {
    throw Error(Error::Kind::output, file_.string(), "is a folder", "give a file name");
  }
  if (!force && std::filesystem::exists(file_, ignored)) {
    throw Error(Error::Kind::usage, file_.string(), "exists already", "--force overwrites it");
  }
  temporary_ = file_;
  temporary_ += ".part-" + std::to_string(::getpid());
}

NewFile::~NewFile() {
  std::error_code ignored;
  if (!committed_) std::filesystem::remove(temporary_, ignored);
}

void NewFile::write(const std::function<void(std::ostream&)>& fill) const {
  const auto fail = [&] {
    throw Error(Error::Kind::output, file_.string(),
                "cannot be written: " + std::generic_category().message(errno),
                "check the folder, its rights and the space left");
  };
  errno = 0;
  std::ofstream stream(temporary_, std::ios::binary | std::ios::trunc);
  if (!stream) fail();
  fill(stream);
  stream.close();
  if (!stream) fail();
}

void NewFile::sync() const { sync_path(temporary_, O_RDONLY, file_); }

void NewFile::commit() {
  std::error_code failure;
  std::filesystem::rename(temporary_, file_, failure);
  if (failure) {
    throw Error(Error::Kind::output, file_.string(), "cannot be put in place: " + failure.message(),
                "check the folder, its rights and the space left");
  }
  committed_ = true;
}

}  // namespace octosurf
