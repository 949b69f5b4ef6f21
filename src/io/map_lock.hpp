#pragma once

#include <filesystem>
#include <memory>

namespace octosurf::io {

/// Keeps other processes from writing a map while this lives: a locked file NAME.lock beside it, with process
/// and host. The system frees the lock when its process ends, however that is, and with it the children that
/// it forked; these neither have nor free it.
class MapLock {
 public:
  /// Within one process the same lock may be taken again. Throws Error(output) if another process has it, or
  /// the file cannot be written, Error(usage) unless `stem` names a map.
  explicit MapLock(const std::filesystem::path& stem);

 private:
  struct Held;
  std::shared_ptr<Held> held_;
};

}  // namespace octosurf::io
