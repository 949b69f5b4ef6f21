#pragma once

#include <filesystem>
#include <memory>
#include <string>

namespace octosurf::io {

/// Keeps other processes from writing a map while this lives: a locked file NAME.lock beside it, with process
/// and host. The system frees the lock when its process ends, however that is; what the file says of it stays
/// after a kill, and is then taken over.
class MapLock {
 public:
  /// Within one process the same lock may be taken again. Throws Error(output) if another process has it, or
  /// the file cannot be written.
  explicit MapLock(const std::filesystem::path& stem);

  /// Whose lock was taken over; empty: nobody's.
  const std::string& note() const { return note_; }

 private:
  struct Held;
  std::shared_ptr<Held> held_;
  std::string note_;
};

}  // namespace octosurf::io
