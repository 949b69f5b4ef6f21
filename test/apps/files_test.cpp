// Maps from one verb to the next: damaged on the way, cleared in part, locked by whoever writes.
#include "apps/command.hpp"
#include "checkpoints.hpp"
#include "io/map_lock.hpp"
#include "support/same_octree.hpp"

#include <unistd.h>

#include <octosurf/adapters/octree.hpp>
#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

class Files : public FloorTest {};

/// That every key is there and what it holds is test/io's; here real outlines lie on their planes.
TEST_F(CommandTest, ExportedSurfacesAreThoseOfTheMap) {
  simulate_room();
  run_well("map room -o m --first 4 --resolution 0.05");
  for (const std::string options : {" --as-mapped", " --force"}) {
    run_well("export m --to m.json" + options);
    const json surfaces = read_json("m.json").at("surfaces");
    EXPECT_EQ(surfaces.size(), info("m").at("surfaces"));
    for (const json& surface : surfaces) {
      const json &normal = surface.at("plane").at("normal"), &covariance = surface.at("covariance");
      for (const int variance : {0, 4, 8}) EXPECT_GT(covariance.at(variance), 0);
      EXPECT_NE(surface.at("polygons").empty(), surface.at("area_m2") > 0);
      std::vector<json> rings{surface.at("boundary")};
      for (const json& polygon : surface.at("polygons")) {
        rings.push_back(polygon.at("outer"));
        EXPECT_EQ(polygon.at("outer_edges").size(), polygon.at("outer").size());
        EXPECT_EQ(polygon.at("hole_edges").size(), polygon.at("holes").size());
      }
      for (const json& ring : rings)
        for (const json& p : ring) {
          double height = 0;
          for (int i = 0; i < 3; ++i) height += normal.at(i).get<double>() * p.at(i).get<double>();
          EXPECT_NEAR(height, surface.at("plane").at("offset"), 1e-6);
        }
    }
  }
}

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

TEST_F(Files, DamagedMapsAreRefused) {
  const std::string whole = read("m.surfaces");
  for (const std::string& bytes : {std::string(), whole.substr(0, whole.size() / 2)}) {
    write("m.surfaces", bytes);
    fails("info m", {"m.surfaces"});
    fails("map floor --resume m", {"m.surfaces"});
    EXPECT_TRUE(read("m.surfaces") == bytes);
  }
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

}  // namespace
}  // namespace octosurf::test
