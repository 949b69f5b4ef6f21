// Every public function that reads a file, given what is no such file: an Error and nothing else.
#include "support/paths.hpp"
#include "support/seed.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <random>
#include <string_view>
#include <unistd.h>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::fuzz {
namespace {

namespace fs = std::filesystem;

struct Reader {
  const char* name;
  std::function<void(const fs::path&)> read;
};

void read_all(const std::vector<fs::path>& inputs, const ScanSourceOptions& options) {
  const auto scans = open_scans(inputs, options);
  while (scans->next()) {
  }
}

const std::vector<Reader>& readers() {
  static const std::vector<Reader> all{
      {"load_map", [](const fs::path& p) { load_map(p); }},
      {"map_from_octomap", [](const fs::path& p) { map_from_octomap(p, {}); }},
      {"read_octomap_resolution", [](const fs::path& p) { read_octomap_resolution(p); }},
      {"is_occupancy_map and open_scans",
       [](const fs::path& p) {
         is_occupancy_map(p);
         read_all({p}, {});
       }},
      {"open_scans", [](const fs::path& p) { read_all({p}, {}); }},
      {"open_scans with poses",
       [](const fs::path& p) {
         ScanSourceOptions options;
         options.poses = p;
         read_all({fs::path(test::paths::source()) / "test/fuzz/corpus/pcd/ascii.pcd"}, options);
       }},
      {"open_scans with intrinsics", [](const fs::path& p) {
         ScanSourceOptions options;
         options.poses = fs::path(test::paths::source()) / "test/fuzz/corpus/poses/sixteen.txt";
         options.intrinsics = p;
         read_all({fs::path(test::paths::source()) / "test/fuzz/corpus/image/filters.png"}, options);
       }}};
  return all;
}

class OddPaths : public ::testing::Test {
 protected:
  OddPaths() : folder(fs::temp_directory_path() / ("octosurf-odd-" + std::to_string(getpid()))) {
    fs::create_directories(folder);
  }
  ~OddPaths() override {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
  /// `not_by`: a reader that looks at less than what is wrong.
  static void expect_refused(const fs::path& path, std::string_view not_by = {}) {
    for (const Reader& reader : readers()) {
      if (reader.name == not_by) continue;
      SCOPED_TRACE(std::string(reader.name) + " of " + path.string().substr(0, 80));
      try {
        reader.read(path);
        ADD_FAILURE() << "taken";
      } catch (const Error& error) {
        EXPECT_NE(error.kind(), Error::Kind::output);
      }  // anything else fails the test
    }
  }
  fs::path folder;
};

TEST_F(OddPaths, AreRefusedWithAnError) {
  std::ofstream(folder / "file") << "x";
  std::ofstream(folder / "empty");
  fs::create_directory(folder / "folder");
  fs::create_symlink(folder / "nowhere", folder / "dangling");
  fs::create_symlink(folder / "loop", folder / "loop");
  const std::string nul("a\0b", 3);
  for (const fs::path& path :
       {fs::path(), folder / "missing", folder / "empty", folder / "file", folder / "folder",
        folder / "dangling", folder / "loop", folder / "file" / "below", folder / std::string(300, 'n'),
        folder / std::string(9000, 'n'), folder / nul, folder / "\xff\xfe.pcd", fs::path("/dev/null"),
        fs::path("/dev/zero"), fs::path("/proc/self/mem")})
    expect_refused(path);
}

/// Every kind of file with nothing but noise behind the bytes by which it is told.
TEST_F(OddPaths, NoiseIsRefusedWithAnError) {
  std::mt19937_64 rng = test::rng();
  for (const std::string& head : {std::string(), std::string("\x89PNG\r\n\x1a\n"), std::string("P5 "),
                                  std::string("ply\n"), std::string("# .PCD v0.7\nVERSION 0.7\n"),
                                  std::string("# Octomap OcTree binary file\nid OcTree\nres 0.1\ndata\n"),
                                  std::string("\x89OCTSF\r\n\x07\0\0\0", 12)})
    for (const char* ending : {".surfaces", ".bt", ".ot", ".graph", ".pcd", ".ply", ".png", ".pgm", ".txt"})
      for (const std::size_t size : {std::size_t{1}, std::size_t{100}, std::size_t{5000}}) {
        std::string noise = head;
        for (std::size_t i = 0; i < size; ++i) noise.push_back(static_cast<char>(rng() % 256));
        const fs::path file = folder / ("noise" + std::string(ending));
        std::ofstream(file, std::ios::binary) << noise;
        const bool whole_header = head.starts_with("# Octomap");
        expect_refused(file, whole_header ? "read_octomap_resolution" : "");
      }
}

}  // namespace
}  // namespace octosurf::fuzz
