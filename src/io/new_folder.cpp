#include "io/new_folder.hpp"

#include "io/map_file/left_over_files.hpp"
#include "io/new_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

namespace fs = std::filesystem;

Error exists_already(const fs::path& folder) {
  return Error(Error::Kind::usage, folder.string(), "exists already", "--force overwrites it");
}

Error not_written(const fs::path& folder, const char* what, int failure) {
  return Error(Error::Kind::output, folder.string(), what + (": " + std::generic_category().message(failure)),
               "check the folder, its rights and the space left");
}

void require_replaceable(const fs::path& folder, bool force, const NewFolder::IsOurs& ours) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(folder, ignored))) return;
  if (!force) throw exists_already(folder);
  if (!fs::is_directory(fs::symlink_status(folder, ignored)))
    throw Error(Error::Kind::usage, folder.string(), "is not a folder", "give another name");
  const auto known = [&](const fs::directory_entry& entry) {
    return entry.is_regular_file(ignored) && ours(entry.path().filename().string());
  };
  std::error_code failure;
  const fs::directory_iterator entries(folder, failure);
  if (failure) throw not_written(folder, "cannot be read", failure.value());
  if (!std::all_of(entries, {}, known))
    throw Error(Error::Kind::usage, folder.string(), "holds other files", "give a folder of its own");
}

}  // namespace

NewFolder::NewFolder(fs::path folder, bool force, const IsOurs& ours)
    : folder_(std::move(folder)), force_(force) {
  if (!folder_.has_filename()) folder_ = folder_.parent_path();  // NAME/
  require_replaceable(folder_, force, ours);
  temporary_ = folder_;
  temporary_ += new_part_ending();
  std::error_code failure;
  if (!fs::create_directory(temporary_, failure))
    throw not_written(folder_, "cannot be written", failure.value());
}

NewFolder::~NewFolder() {
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);  // gone already after commit(), or the one that was replaced
}

void NewFolder::commit() {
  const auto rename = [&](unsigned how) {
    return ::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, folder_.c_str(), how) == 0 ? 0 : errno;
  };
  int failure = rename(RENAME_NOREPLACE);
  if (failure == EEXIST && !force_) throw exists_already(folder_);
  if (failure == EEXIST) failure = rename(RENAME_EXCHANGE);
  if (failure == EINVAL)
    failure = rename(0);  // a file system that knows neither: onto nothing it is the same
  if (failure != 0) throw not_written(folder_, "cannot be put in place", failure);
  sync_folder(folder_);
}

}  // namespace octosurf::io
