#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

namespace octosurf::io {

/// Writes a file atomically: to `NAME.part`, created new, which commit() renames. If destroyed earlier, the
/// existing file is unchanged. Of two writers of one file at a time the first one fails. The new file keeps
/// the permissions of the one that it replaces.
class NewFile {
 public:
  /// Throws Error(usage) if `file` exists and not `force`, Error(output) if it is a folder, a device, a
  /// symbolic link, or read-only by its mode: one whose owner may not write it, for root, too.
  NewFile(std::filesystem::path file, bool force);
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile();

  const std::filesystem::path& temporary() const { return temporary_; }

  /// Creates the temporary file. Call at most one of these two, once. Throws Error(output).
  void create();
  /// Creates the temporary file and calls `fill` with a binary stream to it. Throws Error(output) if the file
  /// cannot be created or a write fails.
  void write(const std::function<void(std::ostream&)>& fill);

  /// Waits until the data are on disk (fsync). Throws Error(output).
  void sync() const;

  /// sync(), then renames the file. Throws Error(output) if that fails or another writer has taken the
  /// temporary name, Error(usage) if the target has appeared meanwhile and not `force`.
  void commit();

 private:
  std::filesystem::path file_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool force_;
  bool committed_ = false;
};

/// A NewFile, written and committed.
void write_file(const std::filesystem::path& file, bool force,
                const std::function<void(std::ostream&)>& fill);

/// Throws Error(output): `what` could not be done, with the text of `failure`, an errno, and a hint to mend
/// it.
[[noreturn]] void fail_to_write(const std::filesystem::path& file, const std::string& what, int failure);

/// Whether the open file is the one of this name.
bool is_at(int descriptor, const std::filesystem::path& path);

/// ".json" of "FILE.JSON".
std::string ending_of(const std::filesystem::path& file);

/// Whether it is an unfinished NewFile's.
bool is_part(const std::filesystem::path& file);

/// A map's file of this ending, or of none; `stem` may have that of either of its two files.
std::filesystem::path file_of_map(std::filesystem::path stem, const char* ending);

/// Throws Error(usage) unless it names a map: "maps/", "." and ".." do not.
void require_map_name(const std::filesystem::path& stem);

/// Waits until a file, or renames in a folder (that of "x" is ""), are on disk, if the file system supports
/// it. Throws Error(output).
void sync(const std::filesystem::path& path);

}  // namespace octosurf::io
