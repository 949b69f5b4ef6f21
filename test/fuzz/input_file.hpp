#pragma once

#include "fuzz/peak_memory.hpp"
#include "fuzz/targets.hpp"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::fuzz {

/// The input as a file, for readers that take a path; removed at the end.
class InputFile {
 public:
  InputFile(Bytes bytes, const std::string& ending)
      : path_(std::filesystem::temp_directory_path() /
              ("octosurf-fuzz-" + std::to_string(getpid()) + ending)) {
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// A promise that must hold of whatever was accepted.
inline void promise(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

/// `read()`, with its memory measured; empty if it refuses.
template <class Read>
auto accepted(const Read& read) -> std::optional<decltype(read())> {
  const PeakMemory peak(reading_peak);
  try {
    return read();
  } catch (const Error&) {
    return {};
  }
}

}  // namespace octosurf::fuzz
