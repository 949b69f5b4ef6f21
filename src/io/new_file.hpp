#pragma once

#include <filesystem>
#include <functional>
#include <ostream>

namespace octosurf {

/// A file that is complete or not there: written under a temporary name beside its place and renamed
/// by commit(); given up, with whatever was there before untouched, if it is destroyed earlier.
class NewFile {
 public:
  /// Throws Error(usage) if `file` exists and not `force`, Error(output) if it is a folder.
  NewFile(std::filesystem::path file, bool force);
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile();

  const std::filesystem::path& temporary() const { return temporary_; }

  /// Calls `fill` with a binary stream to the temporary file. Throws Error(output) if the file cannot
  /// be opened or a write fails.
  void write(const std::function<void(std::ostream&)>& fill) const;

  /// Waits until what was written is on the disk (fsync). Throws Error(output).
  void sync() const;

  /// Throws Error(output) if the temporary file cannot take its place.
  void commit();

 private:
  std::filesystem::path file_;
  std::filesystem::path temporary_;
  bool committed_ = false;
};

/// Waits until the renames of files in `file`'s folder are on the disk, where the file system can.
/// Throws Error(output).
void sync_folder(const std::filesystem::path& file);

}  // namespace octosurf
