// One writer to a map: whoever comes second is told who the first is.
#include "apps/command.hpp"
#include "checkpoints.hpp"
#include "io/map_lock.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Lock : public FloorTest {};

TEST_F(Lock, WhileOneProcessWritesNoOtherDoes) {
  run_well("map floor -o kept --keep-scans scans");
  std::filesystem::copy(folder / "m.surfaces", folder / "other.surfaces");
  const std::string before = read("m.surfaces"), own = "process " + std::to_string(getpid()) + " of ";
  {
    const io::MapLock held(folder / "m"), remapped(folder / "kept");
    for (const std::string verb :
         {"map floor --resume m", "map floor -o m --force", "clear m --box 0 0 0 1 1 1 --force",
          "merge m other -o m --force", "remap kept"})
      EXPECT_THAT(error_of(verb, 1), AllOf(HasSubstr(".lock: "), HasSubstr(own))) << verb;
    run_well("info m");
    save_map(load_map(folder / "m").map, folder / "m");  // by the process that holds it
  }
  EXPECT_EQ(read("m.surfaces"), before);
  run_well("map floor --resume m");
  EXPECT_FALSE(exists("m.lock"));
}

TEST_F(Lock, OfAProcessThatIsGoneIsTakenOver) {
  write("m.lock", "process 4711 of a-robot\n");
  EXPECT_THAT(run_well("map floor --resume m").err,
              AllOf(HasSubstr("process 4711 of a-robot"), HasSubstr("taken over")));
  EXPECT_FALSE(exists("m.lock"));
}

TEST_F(Lock, OfAForeignFileNothingReachesTheTerminalRaw) {
  write("m.lock", "\x1b[2Jprocess\x07 \xff of\tnobody\n");
  EXPECT_THAT(run_well("map floor --resume m").err, HasSubstr("?[2Jprocess? ? of?nobody had locked"));
}

/// By a copy, or a program that knows no locks.
TEST_F(Lock, AMapThatCameDuringARunStays) {
  for (const char* stem : {"m", "new"}) {
    const LoadedMap loaded = load_map(folder / "m");
    Checkpoints run((folder / stem).string(), 1, false);
    if (stem == std::string("m")) run.save(loaded.map, 1, {});  // its own
    write(stem + std::string(".surfaces"), "of another");
    EXPECT_THROW(run.save(loaded.map, 1, {}), Error) << stem;
    EXPECT_EQ(read(stem + std::string(".surfaces")), "of another");
    std::filesystem::copy_file(folder / "m.bt", folder / "new.bt",
                               std::filesystem::copy_options::skip_existing);
    run_well("map floor -o m --force");
  }
}

}  // namespace
}  // namespace octosurf::test
