#pragma once

#include <filesystem>
#include <functional>
#include <ostream>

namespace octosurf::io {

/// A file that is complete or not there: written under a temporary name beside its place and renamed
/// by commit(); given up, with whatever was there before untouched, if it is destroyed earlier.
///
/// The temporary file, `NAME.part-` and 16 random hexadecimal digits, is always a new one: what stands at
/// that name, a symbolic link say, is never opened. It is locked while its process lives. So what a killed
/// process has left behind is known by its name, its owner and its free lock, and removed when the same
/// file is written again. The file keeps the access rights of the one that it replaces; a symbolic link in
/// its place is replaced, not followed.
class NewFile {
 public:
  /// Whether to look in the folder for what a killed process has left, which takes time where it holds many
  /// files.
  enum class LeftOvers { remove, leave };
  /// Throws Error(usage) if `file` exists and not `force`, Error(output) if it is a folder or a device.
  NewFile(std::filesystem::path file, bool force, LeftOvers left_overs = LeftOvers::remove);
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile();

  /// Empty before write().
  const std::filesystem::path& temporary() const { return temporary_; }

  /// Makes the temporary file and calls `fill` with a binary stream to it. Once at most. Throws Error(output)
  /// if the file cannot be made or a write fails.
  void write(const std::function<void(std::ostream&)>& fill);

  /// Waits until what was written is on the disk (fsync). Throws Error(output).
  void sync() const;

  /// sync(), then puts the file into its place. Throws Error(output) if that fails, Error(usage) if a file
  /// has come there meanwhile and not `force`.
  void commit();

 private:
  void make();
  [[noreturn]] void fail(const char* what, int failure) const;

  std::filesystem::path file_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool force_;
  LeftOvers left_overs_;
  bool committed_ = false;
};

/// Waits until the renames of files in `file`'s folder are on the disk, where the file system can.
/// Throws Error(output).
void sync_folder(const std::filesystem::path& file);

}  // namespace octosurf::io
