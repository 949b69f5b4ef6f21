// Maps from one verb to the next: damaged on the way, cleared in part, locked by whoever writes.
#include "apps/command.hpp"
#include "arrivals.hpp"
#include "checkpoints.hpp"
#include "io/map_lock.hpp"
#include "run_statistics.hpp"
#include "scan_feed.hpp"
#include "support/same_octree.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <octosurf/adapters/octree.hpp>

namespace octosurf::test {
namespace {

using namespace std::string_literals;

class Files : public FloorTest {};

TEST_F(Files, AnOtIsTheMapsOctreeAsOctomapReadsIt) {
  EXPECT_THAT(run_well("export m --to m.ot").out, says("m.ot: "));
  const std::unique_ptr<octomap::AbstractOcTree> read_back(
      octomap::AbstractOcTree::read((folder / "m.ot").string()));
  const auto* tree = dynamic_cast<const octomap::OcTree*>(read_back.get());
  ASSERT_NE(tree, nullptr);
  EXPECT_GT(tree->getNumLeafNodes(), 1000u);
  expect_same(*tree, *to_octree(load_map(folder / "m").map.octree()));
  wrong_use("export m --to m.ot", {"m.ot"});  // it is there
  run_well("map m.ot -o again");
}

TEST_F(Files, InfoTellsTheSameInBothForms) {
  const json contents = info("m");
  EXPECT_EQ(contents.at("warnings"), json::array());
  const auto line = [](std::string name, const std::string& text) {
    name.resize(20, ' ');
    return name + ' ' + text + '\n';
  };
  EXPECT_THAT(run_well("info m").out, says(line("resolution", "0.02"), line("scans", "6"),
                                           line("surfaces", "1"), line("max hole size", "0.08"),
                                           line("points", contents.at("points").dump()), "largest 1\n"));
}

TEST_F(Files, ABtThatDoesNotMatchIsNamed) {
  run_well("map floor -o n --first 2");
  write("n.bt", "something else");
  const Outcome looked = run_well("info n --json");
  EXPECT_THAT(looked.err, says("n.bt"));
  EXPECT_EQ(json::parse(looked.out).at("warnings").size(), 1u);
  run_well("map floor --resume n --skip 2 --report r.json");
  EXPECT_EQ(read_json("r.json").at("warnings").size(), 1u);
  EXPECT_EQ(info("n").at("warnings").size(), 0u);  // written anew
}

/// By every verb that writes a map: it is named and kept.
TEST_F(Files, ABtOfSomebodyElsesIsNamedAndKept) {
  run_well("map floor -o kept --first 2 --keep-scans scans");
  run_well("map floor -o other --skip 3");
  const std::string theirs = read("other.bt");
  for (const std::string verb : {"map floor -o n", "clear m --box 0 0 -1 1 1 1 -o n", "remap kept -o n",
                                 "merge m other --anyway -o n"}) {
    for (const char* const ending : {".surfaces", ".bt", ".edited.bt"}) fs::remove(folder / ("n"s + ending));
    write("n.bt", theirs);
    wrong_use(verb, {"n.bt: exists already", "--force"});
    EXPECT_THAT(run_well(verb + " --force").err, says("warning: n.bt: ", "n.edited.bt")) << verb;
    EXPECT_EQ(read("n.edited.bt"), theirs) << verb;
    EXPECT_NE(read("n.bt"), theirs) << verb;
  }
}

TEST_F(Files, AFolderIsNoMapAndALinkIsRefused) {
  for (const std::string name : {"dir/", ".", "dir/.."})
    for (const std::string verb :
         {"map floor -o ", "clear m --box 0 0 -1 1 1 1 --force -o ", "merge m m2 -o "})
      wrong_use(verb + name, {"names no map"});
  EXPECT_FALSE(exists("dir"));
  fs::create_directory(folder / "real");
  fs::rename(folder / "m.surfaces", folder / "real/m.surfaces");
  fs::create_symlink("real/m.surfaces", folder / "m.surfaces");
  const std::string before = read("m.surfaces");
  fails("map floor --resume m", {"m.surfaces: is a symbolic link", "real/m.surfaces"});
  EXPECT_EQ(read("real/m.surfaces"), before);
}

TEST_F(FloorTest, ClearTakesBackWhatIsInside) {
  const std::string at_floor = "--voxel 0.1 0.1 " + std::to_string(floor_height);
  const auto area_m2 = [&](const std::string& map, const std::string& at) {
    return json_of("query " + map + " --json --nearest " + at).at("area_m2").get<double>();
  };
  const double whole = area_m2("m", "0 0 0.5");
  wrong_use("clear m --box -2 -2 -1 0.2 2 1", {"--force"});
  EXPECT_THAT(run_well("clear m --box 0.2 2 1 -2 -2 -1 -o n").out,
              says("0 surfaces gone, 1 smaller, 1 left"));
  EXPECT_LT(area_m2("n", "0.4 0 0.5"), 0.8 * whole);
  EXPECT_EQ(json_of("query n --json " + at_floor).at("state"), "unknown");
  EXPECT_EQ(area_m2("m", "0 0 0.5"), whole);  // the old files are as they were
  run_well("clear m --cylinder 0 0 -1 9 2 --free --force");
  EXPECT_EQ(ask(at_floor).at("state"), "free");
  EXPECT_EQ(run("clear n").code, 2);
  wrong_use("clear n --box 0 0 0 0 1 1 --force", {"--box: is empty"});
  wrong_use("clear n --cylinder 0 0 0 0 1 --force", {"--cylinder: is empty"});
  const std::string before = read("n.surfaces");
  fails("clear n --box 50 50 0 51 51 1 --force", {"nothing is known"});
  fails("clear n --box 50 50 0 51 51 1 --free -o o", {"nothing is written"});
  EXPECT_EQ(read("n.surfaces"), before);
  EXPECT_FALSE(exists("o.surfaces") || exists("o.lock"));
  write("n.bt", read("m.bt"));  // as another tool may do
  EXPECT_THAT(run_well("clear n --cylinder 0.4 0 -1 0.1 2 --force").err, says("kept as n.edited.bt"));
  EXPECT_EQ(read("n.edited.bt"), read("m.bt"));
  // What is there comes back by other scans; those that are in the map are not mapped again.
  write_floor("again", 6, 0.0005);
  run_well("map again --resume n -o n --force");
  EXPECT_NEAR(area_m2("n", "0.4 0 0.5"), whole, 0.02 * whole);
}

class Lock : public FloorTest {};

TEST_F(Lock, WhileOneProcessWritesNoOtherDoes) {
  run_well("map floor -o kept --keep-scans scans");
  fs::copy(folder / "m.surfaces", folder / "other.surfaces");
  const std::string before = read("m.surfaces"), own = "process " + std::to_string(getpid()) + " of ";
  {
    const io::MapLock held(folder / "m"), remapped(folder / "kept");
    for (const char* verb : {"map floor --resume m", "map floor -o m --force",
                             "clear m --box 0 0 0 1 1 1 --force", "merge m other -o m --force", "remap kept"})
      fails(verb, {".lock: ", own});
    run_well("info m");
    save_map(load_map(folder / "m").map, folder / "m");  // by the process that holds it
  }
  EXPECT_EQ(read("m.surfaces"), before);
  run_well("map floor --resume m");
  EXPECT_FALSE(exists("m.lock"));
}

/// As Python's multiprocessing starts workers: what they let go of is the parent's still.
TEST_F(Lock, AForkedChildNeitherFreesNorHasIt) {
  auto held = std::make_optional<io::MapLock>(folder / "m");
  const pid_t child = ::fork();
  if (child == 0) {
    int wrong = 0;
    try {
      const io::MapLock again(folder / "m");
      wrong = 1;
    } catch (const Error&) {
    }
    held.reset();
    ::_exit(wrong);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0) << "the child has it, too";
  EXPECT_TRUE(exists("m.lock"));
  fails("map floor --resume m", {".lock: process " + std::to_string(::getpid())});
  held.reset();
  EXPECT_FALSE(exists("m.lock"));
}

TEST_F(Lock, OfAProcessThatIsGoneIsTakenOver) {
  write("m.lock", "process 4711 of a-robot\n");
  EXPECT_THAT(run_well("map floor --resume m").errors, IsEmpty());
  EXPECT_FALSE(exists("m.lock"));
}

/// By a copy, or a program that knows no locks.
TEST_F(Lock, AMapThatCameDuringARunStays) {
  for (const std::string stem : {"m", "new"}) {
    const LoadedMap loaded = load_map(folder / "m");
    Checkpoints run((folder / stem).string(), 1, false);
    if (stem == "m") run.save(loaded.map, 1, {});  // its own
    write(stem + ".surfaces", "of another");
    EXPECT_THROW(run.save(loaded.map, 1, {}), Error) << stem;
    EXPECT_EQ(read(stem + ".surfaces"), "of another");
    fs::copy_file(folder / "m.bt", folder / "new.bt", fs::copy_options::skip_existing);
    run_well("map floor -o m --force");
  }
}

// Parts of the command by themselves: scans that wait, and the report's numbers, from scans whose every
// number is known. What a range takes, MapRun has.

using nlohmann::json;

/// Names its scans 0 to 6; one comes every 0.1 s.
class SevenScans : public ScanSource {
 public:
  std::size_t size() const override { return 7; }
  std::optional<Scan> next() override {
    if (given_ == 7) return {};
    Scan scan;
    scan.stamp_s = 0.1 * given_;
    scan.name = std::to_string(given_++);
    return scan;
  }
  const std::vector<std::string>& skipped() const override { return skipped_; }

 private:
  int given_ = 0;
  std::vector<std::string> skipped_;
};

TEST(Arrivals, ScansThatHaveWaitedForLongAreMappedTogether) {
  double now_s = 100;
  Arrivals arrivals([&] { return now_s; });
  ScanFeed feed(std::make_unique<SevenScans>(), {});
  std::optional<double> last_stamp_s;
  const auto mapped_at = [&](double since_first_s) {
    now_s = 100 + since_first_s;
    std::vector<PreparedScan> scans;
    scans.emplace_back(*feed.next());
    arrivals.wait_and_join(scans, feed, last_stamp_s);
    last_stamp_s = scans.back().scan().stamp_s;
    return scans.size();
  };
  EXPECT_EQ(mapped_at(0), 1U);
  EXPECT_EQ(mapped_at(0.5), 1U) << "it waited 0.4 s, and so did others for less";
  EXPECT_EQ(mapped_at(0.75), 5U) << "it waited 0.55 s, and the last came at 0.6 s";
}

class Statistics : public ::testing::Test {
 protected:
  void add(double stamp_s, double arrival_s, double done_s, std::size_t appeared, std::size_t categorized = 0,
           bool born = false) {
    Scan scan;
    scan.stamp_s = stamp_s;
    ScanReport report;
    report.points_raw = 1000;
    report.appeared = appeared;
    report.categorized = categorized;
    if (born) report.born = {1};
    report.stage_ms[static_cast<std::size_t>(Stage::downsample)] = 10 * stamp_s;
    report.total_ms = 100 * stamp_s;
    statistics.add(scan, report, arrival_s, done_s);
  }
  json report() const { return json::parse(statistics.to_json(map)); }

  Map map;
  RunStatistics statistics{map.parameters()};
};

TEST_F(Statistics, FirstDetectionCountsFromTheFirstArrival) {
  add(1, 10, 11, 5);
  EXPECT_TRUE(report().at("time_to_first_detection_s").is_null());
  add(2, 12, 13.5, 5, 0, true);
  add(3, 14, 20, 5, 0, true);
  EXPECT_DOUBLE_EQ(report().at("time_to_first_detection_s"), 3.5);
}

TEST_F(Statistics, LagIsOverPointsNotScans) {
  add(1, 0, 4, 100, 1, true);
  add(2, 10, 11, 100);  // brought nothing that was categorised
  add(3, 20, 20.5, 100, 97);
  add(4, 30, 31, 100, 2);
  const json lag = report().at("detection_lag_s");
  EXPECT_DOUBLE_EQ(lag.at("mean"), (4 * 1 + 0.5 * 97 + 1 * 2) / 100);
  EXPECT_DOUBLE_EQ(lag.at("p50"), 0.5);
  EXPECT_DOUBLE_EQ(lag.at("p95"), 0.5);
  EXPECT_DOUBLE_EQ(lag.at("max"), 4);
}

TEST_F(Statistics, PercentilesAreNearestRank) {
  for (int i = 100; i >= 1; --i) add(i, 0, 1, 1);
  EXPECT_EQ(report().at("scan_ms"),
            json({{"p50", 5000.0}, {"p95", 9500.0}, {"p99", 9900.0}, {"max", 10000.0}}));
  const json stage_ms = report().at("stage_ms").at("downsample");
  EXPECT_DOUBLE_EQ(stage_ms.at("p50"), 500);
  EXPECT_DOUBLE_EQ(stage_ms.at("total"), 50500);
  EXPECT_DOUBLE_EQ(statistics.scan_ms().percentile(0.5), 5000);
}

TEST_F(Statistics, WhatIsNotDefinedIsNull) {
  for (const char* key : {"/points_per_second", "/time_to_first_detection_s", "/categorized_percent",
                          "/scan_ms/p50", "/detection_lag_s/mean"})
    EXPECT_TRUE(report().at(json::json_pointer(key)).is_null()) << key;
  EXPECT_EQ(report().at("stage_ms").at("derive").at("total"), 0);
}

}  // namespace
}  // namespace octosurf::test
