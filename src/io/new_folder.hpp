#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace octosurf::io {

/// A folder that is complete or not there: filled under a temporary name beside its place (as NewFile's) and
/// renamed by commit(); given up, with whatever was there before untouched, if it is destroyed earlier.
class NewFolder {
 public:
  using IsOurs = std::function<bool(const std::string& name)>;

  /// With `force` a folder in its place is replaced, if `ours` knows the names of all its files: what is not
  /// of this format is nobody's to delete. Throws Error(usage) if something is there that may not be
  /// replaced, Error(output) if the temporary folder cannot be made.
  NewFolder(std::filesystem::path folder, bool force, const IsOurs& ours);
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  ~NewFolder();

  /// Where the files go for now.
  const std::filesystem::path& temporary() const { return temporary_; }

  /// Throws Error(output) if it cannot be put in place, Error(usage) if something has come there meanwhile
  /// and not `force`.
  void commit();

 private:
  std::filesystem::path folder_, temporary_;
  bool force_;
};

}  // namespace octosurf::io
