#pragma once

#include "fuzz/targets.hpp"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>

#include <octosurf/error.hpp>

namespace octosurf::fuzz {

/// A new folder for inputs, for readers that take a path; removed at the end.
class InputFolder {
 public:
  InputFolder() {
    std::string folder = (std::filesystem::temp_directory_path() / "octosurf-fuzz-XXXXXX").string();
    if (::mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = folder;
  }
  InputFolder(const InputFolder&) = delete;
  InputFolder& operator=(const InputFolder&) = delete;
  ~InputFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path add(const std::string& name, Bytes bytes) const {
    std::ofstream(path_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The input as a file, alone in its folder: readers look for poses and intrinsics beside it, and an input
/// may name files there.
class InputFile {
 public:
  InputFile(Bytes bytes, const std::string& ending) : path_(folder_.add("input" + ending, bytes)) {}
  const std::filesystem::path& path() const { return path_; }

 private:
  InputFolder folder_;
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
