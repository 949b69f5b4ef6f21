#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <string>
#include <thread>

namespace octosurf {

/// Bytes of a text like 256M, 1.5G or 300000k, in powers of 1024. Throws Error(usage), naming `option`.
std::size_t bytes_of(const std::string& text, const std::string& option);

/// Keeps the process within a number of bytes while it lives: what grows with the map is in a scratch file,
/// and leaves the process when that comes near the limit (geometry/page_file.hpp). What is needed comes back
/// by itself, so results do not depend on it, nor on when it happens.
class MemoryLimit {
 public:
  /// 0: none. The file is in `folder`; call before a map is made. Throws Error(output).
  MemoryLimit(std::size_t bytes, const std::filesystem::path& folder);

  /// Warns if the process needed more, with how much that was.
  void warn_if_exceeded() const;

 private:
  void watch(const std::stop_token& stop);

  std::size_t limit_;
  std::atomic<std::size_t> most_ = 0;  // of what the process had, once dropping could not help
  std::jthread watcher_;
};

}  // namespace octosurf
