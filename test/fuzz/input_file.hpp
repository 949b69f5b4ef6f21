#pragma once

#include "fuzz/peak_memory.hpp"
#include "fuzz/targets.hpp"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::fuzz {

/// The input as a file, for readers that take a path; removed at the end. It stands in a new folder alone:
/// readers look for poses and intrinsics beside it, and an input may name files there.
class InputFile {
 public:
  InputFile(Bytes bytes, const std::string& ending) {
    std::string folder = (std::filesystem::temp_directory_path() / "octosurf-fuzz-XXXXXX").string();
    if (::mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = std::filesystem::path(folder) / ("input" + ending);
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile() {
    std::error_code ignored;
    std::filesystem::remove_all(path_.parent_path(), ignored);
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
