// The past of a map: `octosurf log`, `checkout`, and `diff` between dates.
#include "apps/command.hpp"

#include <cstdio>
#include <gmock/gmock.h>

#include <octosurf/map.hpp>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double first_noon_s = 1795780800;  // 2026-11-27T12:00:00Z
constexpr double day_s = 86400;

class Past : public CommandTest {
 protected:
  /// Six images of a floor, taken from above, at noon of a day since 2026-11-27, and on it a crate of a
  /// square metre's quarter, whose place and height differ from day to day.
  void write_day(int day) const {
    const std::string name = "day" + std::to_string(day);
    std::string poses;
    for (int image = 0; image < 6; ++image) {
      const double camera_x = 0.1 * image, crate_x = -0.4 + 0.13 * (day % 5);
      std::string content = "P5\n80 60\n65535\n";
      for (int v = 0; v < 60; ++v)
        for (int u = 0; u < 80; ++u) {
          // Looks down from 1 m: x of the map along u, y against v.
          const double top = 0.2 + 0.02 * (day % 3);
          const double x = camera_x + (u - 39.5) / 60 * (1 - top), y = (29.5 - v) / 60 * (1 - top);
          const bool on_crate = x >= crate_x && x <= crate_x + 0.5 && y >= -0.25 && y <= 0.25;
          const int depth_mm = static_cast<int>(1000 * (1 - (on_crate ? top : 0)));
          content += static_cast<char>(depth_mm >> 8);
          content += static_cast<char>(depth_mm & 255);
        }
      char stamp[40];
      std::snprintf(stamp, sizeof stamp, "%.6f", first_noon_s + day * day_s + image / 30.0);
      write(name + "/" + stamp + ".pgm", content);
      poses += std::string(stamp) + " " + std::to_string(camera_x) + " 0 1 1 0 0 0\n";
    }
    write(name + "/poses.txt", poses);
    write(name + "/intrinsics.txt", "60 60 39.5 29.5\n");
  }
  /// Maps a day into `map` and keeps a copy of what that gave.
  std::string map_day(int day) const {
    write_day(day);
    const std::string name = "day" + std::to_string(day);
    const std::string told =
        run_well("map " + name + " -o map" + (exists("map.surfaces") ? " --resume map" : "")).out;
    std::filesystem::copy_file(folder / "map.surfaces", folder / (name + ".surfaces"));
    std::filesystem::copy_file(folder / "map.bt", folder / (name + ".bt"));
    return told;
  }
};

TEST_F(Past, GivesEachDayBackByteForByte) {
  constexpr int days = 6;
  for (int day = 0; day < days; ++day) {
    const std::string told = map_day(day);
    EXPECT_THAT(told, HasSubstr(day == 0 ? "surfaces" : "session " + std::to_string(day + 1) + ", "));
  }
  const json log = json::parse(run_well("log map --json").out);
  ASSERT_EQ(log.size(), std::size_t{days});
  for (int day = 0; day < days; ++day) {
    const std::string name = "day" + std::to_string(day), date = "2026-" +
                                                                 std::string(day < 4 ? "11-" : "12-0") +
                                                                 std::to_string(day < 4 ? 27 + day : day - 3);
    EXPECT_EQ(log[day].at("date"), date + "T12:00:00Z");
    EXPECT_EQ(log[day].at("scans"), 6 * (day + 1));
    run_well("checkout map@" + date + " -o then --force");
    EXPECT_EQ(read("then.surfaces"), read(name + ".surfaces")) << date;
    EXPECT_EQ(read("then.bt"), read(name + ".bt")) << date;
    run_well("checkout map@" + std::to_string(day + 1) + " -o then --force");
    EXPECT_EQ(read("then.bt"), read(name + ".bt"));
  }
  const std::string between = run_well("diff --json day1 day3").out;
  EXPECT_EQ(run_well("diff --json map@2026-11-28 map@2026-11-30T12:01").out, between);
  EXPECT_EQ(run_well("diff --json map@2 map@4").out, between);
}

TEST_F(Past, RefusesMomentsThatItDoesNotHave) {
  map_day(0);
  map_day(1);
  EXPECT_THAT(error_of("checkout map@2026-11-26 -o then", 2),
              HasSubstr("before its first session, 2026-11-27"));
  EXPECT_THAT(error_of("checkout map@3 -o then", 2), HasSubstr("none of its 2 sessions"));
  for (const char* date : {"2026-02-31", "2026-13-01", "2026-11-31T09:30"})
    EXPECT_THAT(error_of(std::string("checkout -o then map@") + date, 2), HasSubstr("names no date"));
  EXPECT_THAT(error_of("checkout map@yesterday -o then", 2), HasSubstr("names no date"));
  EXPECT_THAT(error_of("checkout map -o then", 2), HasSubstr("names no date"));
  EXPECT_THAT(error_of("checkout map@1 -o map --force", 2), HasSubstr("map.surfaces"));
  EXPECT_THAT(error_of("checkout map@1 -o day0", 2), HasSubstr("--force"));
  EXPECT_FALSE(exists("then.surfaces"));
}

/// Whatever becomes of a session's file, the map is read and gone on with; only what lies before it is lost.
TEST_F(Past, OfADamagedSessionWhatLiesBeforeIsLostAlone) {
  for (int day = 0; day < 4; ++day) map_day(day);
  const auto session_file = [this](int number) {
    const json log = json::parse(run_well("log map --json").out);
    return log.at(static_cast<std::size_t>(number - 1)).at("file").get<std::string>();
  };
  const std::string second = session_file(2), whole = read(second);
  std::string damaged = whole;
  damaged[damaged.size() / 2] = static_cast<char>(~damaged[damaged.size() / 2]);
  for (const std::string& content : {damaged, std::string(), std::string("gone")}) {
    write(second, content);
    if (content == "gone") std::filesystem::remove(folder / second);
    const Outcome log = run("log map --json");
    EXPECT_EQ(json::parse(log.out).size(), 2U);
    EXPECT_THAT(log.err, HasSubstr("what lies before it is not known"));
    EXPECT_EQ(log.err.find(second) != std::string::npos, content != "gone");
    run_well("checkout map@1 -o then --force");
    EXPECT_EQ(read("then.surfaces"), read("day2.surfaces"));
  }
  write_day(4);
  EXPECT_EQ(run("map day4 -o map --resume map").code, 0);
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 3U);
  write(second, whole);  // from a backup: all of it is there again
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 5U);
  run_well("checkout map@1 -o then --force");
  EXPECT_EQ(read("then.surfaces"), read("day0.surfaces"));
  EXPECT_FALSE(exists("map.before"));
}

TEST_F(Past, VerbsThatWriteAMapInPlaceAreSessionsOfIt) {
  write_day(0);
  run_well("map day0 -o map --keep-scans scans");
  map_day(1);
  run_well("remap map");
  run_well("clear map --box -1 -1 -1 0 1 1 --force");
  write_day(2);
  run_well("map day2 -o other");
  const std::string before = read("map.bt");
  run_well("merge map other -o map --force");
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 5U);
  run_well("checkout map@4 -o then");
  EXPECT_EQ(read("then.bt"),
            before);  // the map also names its kept scans, which a state of the past does not
  run_well("checkout map@2 -o then --force");
  EXPECT_EQ(read("then.bt"), read("day1.bt"));
  EXPECT_THAT(run_well("merge then other -o map --force").err, HasSubstr("ends here, after 5 sessions"));
}

/// A recording of October that is mapped in November.
TEST_F(Past, OfScansThatCameLateNoDateBeforeThem) {
  map_day(3);
  write_day(0);
  run_well("map day0 -o map --resume map");
  const json log = json::parse(run_well("log map --json").out);
  EXPECT_EQ(log.at(0).at("date"), "2026-11-30T12:00:00Z");
  EXPECT_EQ(log.at(1).at("date"), "2026-11-27T12:00:00Z");
  for (const json& session : log) EXPECT_NE(session.at("written"), session.at("date"));
  EXPECT_THAT(error_of("checkout map@2026-11-28 -o then", 2),
              HasSubstr("before its first session, 2026-11-30"));
  run_well("checkout map@2026-11-30 -o then");
  EXPECT_EQ(read("then.surfaces"), read("map.surfaces"));
}

/// A run that is killed after a checkpoint leaves the session before as the last that is known, and the next
/// session counts from that.
TEST_F(Past, OfAMapOfOneSessionGoesWithIt) {
  map_day(0);
  write_day(1);
  for (int time = 0; time < 2; ++time)
    EXPECT_THAT(run_well("map day1 -o map --force").err, Not(HasSubstr("past")));
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 1U);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files += entry.path().filename().string().starts_with("map.past");
  EXPECT_EQ(files, 1);
}

TEST_F(Past, OutlivesAKilledRun) {
  map_day(0);
  map_day(1);
  write_day(2);
  // As a run leaves it that was killed after a checkpoint.
  run_well("map day2 -o cut --resume map");
  std::filesystem::copy_file(folder / "map.surfaces", folder / "map.before");
  for (const char* ending : {".surfaces", ".bt"})
    std::filesystem::rename(folder / ("cut" + std::string(ending)), folder / ("map" + std::string(ending)));
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 2U);
  run_well("checkout map@2 -o then");
  EXPECT_EQ(read("then.surfaces"), read("day1.surfaces"));
  map_day(3);
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 3U);
  run_well("checkout map@2 -o then --force");
  EXPECT_EQ(read("then.surfaces"), read("day1.surfaces"));
  run_well("checkout map@3 -o then --force");
  EXPECT_EQ(read("then.surfaces"), read("day3.surfaces"));
}

TEST_F(Past, StaysWhereARunFailsAtItsFirstScan) {
  map_day(0);
  map_day(1);
  write_day(2);
  run_well("map day2 -o other");
  // As a killed run left them: the map is of no session, NAME.before is that of the last.
  std::filesystem::rename(folder / "map.surfaces", folder / "map.before");
  std::filesystem::rename(folder / "other.surfaces", folder / "map.surfaces");
  write("day2/" + std::to_string(static_cast<long>(first_noon_s + 2 * day_s)) + ".000000.pgm", "P5\n80 60\n");
  for (const char* how : {" --resume map", " --force"}) {
    run(std::string("map day2 -o map --pose-form as-given") + how);
    EXPECT_TRUE(exists("map.before")) << how;
  }
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 2U);
}

TEST_F(Past, GoesWithAMapThatIsGoneOnWithElsewhere) {
  map_day(0);
  write_day(1);
  run_well("map day1 -o other --resume map");
  EXPECT_EQ(json::parse(run_well("log map --json").out).size(), 1U);
  EXPECT_EQ(json::parse(run_well("log other --json").out).size(), 2U);
  run_well("checkout other@1 -o then");
  EXPECT_EQ(read("then.surfaces"), read("day0.surfaces"));
}

}  // namespace
}  // namespace octosurf::test
