// Whatever fails while a map is saved, what loads afterwards is the map of before or the new one.
#include "io/map_file/failing_calls.hpp"
#include "io/new_file.hpp"
#include "map_files.hpp"
#include "support/full_disk.hpp"

#include <cerrno>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Voxels so large that the files are few thousand bytes.
Parameters very_coarse() {
  Parameters parameters;
  parameters.occupancy.resolution = 0.5;
  return parameters;
}

class SaveFails : public MapFiles {
 protected:
  SaveFails() {
    save_map(before, stem);
    surfaces = read_file(stem.string() + ".surfaces");
    bt = read_file(stem.string() + ".bt");
    save_map(after, folder / "new");
  }

  bool nothing_changed() const {
    return read_file(stem.string() + ".surfaces") == surfaces && read_file(stem.string() + ".bt") == bt &&
           count_files() == 4;
  }
  std::uintmax_t new_size(const char* ending) const {
    return fs::file_size((folder / "new").string() + ending);
  }

  Map before = map_of(changing_room(3), very_coarse()), after = map_of(changing_room(5), very_coarse());
  fs::path stem = folder / "map";
  std::string surfaces, bt;
};

TEST_F(SaveFails, AtEveryByteOfItsFilesAndKeepsWhatWasThere) {
  const std::uintmax_t largest = std::max(new_size(".bt"), new_size(".surfaces"));
  for (std::uintmax_t bytes = 0; bytes < largest; ++bytes) {
    std::string message;
    {
      const FullDisk full(bytes);
      message = failure(Error::Kind::output, [&] { save_map(after, stem); });
    }
    ASSERT_THAT(message, HasSubstr("cannot be written: File too large")) << bytes;
    ASSERT_TRUE(nothing_changed()) << bytes;
  }
  const FullDisk large_enough(largest);
  save_map(after, stem);
  EXPECT_EQ(read_file(stem.string() + ".surfaces"), read_file(folder / "new.surfaces"));
}

TEST_F(SaveFails, AtEverySystemCallAndWhatLoadsIsWhole) {
  std::size_t refused = 0, warned = 0;
  for (std::size_t n = 0;; ++n) {
    save_map(before, stem);
    std::string message;
    fail_call_after(n, EIO);
    try {
      save_map(after, stem);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::output);
      message = error.what();
    }
    if (!stop_failing_calls()) {  // as many as there are
      EXPECT_EQ(message, "");
      break;
    }
    EXPECT_THAT(message, AnyOf(HasSubstr("Input/output error"), IsEmpty())) << "call " << n;
    refused += !message.empty();
    const LoadedMap loaded = load_map(stem);
    EXPECT_TRUE(difference(loaded.map, before).empty() || difference(loaded.map, after).empty())
        << "call " << n;
    warned += !loaded.warning.empty();
    EXPECT_EQ(count_files(), 4U) << "a temporary file is left; call " << n;
  }
  EXPECT_GE(refused, 7U) << "two files written, synced and renamed, and their folder synced";
  EXPECT_LE(warned, 2U) << "only between the two renames a .bt is not the map's own";
}

}  // namespace
}  // namespace octosurf::test
