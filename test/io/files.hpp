// What tests of files share: a folder, a file's bytes, an Error's message, and what most of them include.
#pragma once

#include "support/testing.hpp"

#include <stdlib.h>

namespace octosurf::test {

namespace fs = std::filesystem;
using ::testing::AllOf, ::testing::AnyOf, ::testing::Contains, ::testing::DoubleNear, ::testing::ElementsAre,
    ::testing::HasSubstr, ::testing::IsEmpty, ::testing::Not, ::testing::SizeIs;

/// Matches what holds all the texts.
template <class... Text>
auto says(const Text&... texts) {
  return AllOf(HasSubstr(texts)...);
}

/// A fresh folder for every test, removed afterwards.
class FolderTest : public ::testing::Test {
 protected:
  FolderTest() {
    std::string name = (fs::temp_directory_path() / "octosurf_test_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder = name;
  }
  ~FolderTest() override { fs::remove_all(folder); }

  fs::path path(const std::string& name) const { return folder / name; }
  std::size_t count_files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
  }

  fs::path folder;
};

inline std::string read_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_file(const fs::path& file, std::string_view content) {
  std::ofstream(file, std::ios::binary) << content;
}

/// The message of the Error of this kind that `work` throws; fails the test if there is none.
template <class Work>
std::string failure(Error::Kind kind, const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return {};
}

}  // namespace octosurf::test
