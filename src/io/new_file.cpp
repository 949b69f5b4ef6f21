#include "io/new_file.hpp"

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {

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
