// Maps from one verb to the next, and maps that were damaged on the way.
#include "apps/command.hpp"
#include "support/paths.hpp"
#include "support/same_octree.hpp"

#include <cstdlib>
#include <gmock/gmock.h>

#include <octosurf/adapters/octree.hpp>
#include <octosurf/map.hpp>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Files : public CommandTest {};

TEST_F(Files, ExportedSurfacesAreReadByPython) {
  simulate_room();
  run_well("map room -o m --first 4 --resolution 0.05");
  const std::string check = "python3 '" + test::paths::source() + "/test/apps/check_surfaces.py' '";
  const auto expect_surfaces = [&](const std::string& file, int count) {
    EXPECT_EQ(std::system((check + (folder / file).string() + "' " + std::to_string(count)).c_str()), 0);
  };
  run_well("export m --to mapped.json --as-mapped");
  expect_surfaces("mapped.json", info("m").at("surfaces").get<int>());
  run_well("export m --to m.json");
  expect_surfaces("m.json", info("m").at("surfaces").get<int>());
}

TEST_F(Files, InfoOfAFolderSaysHowItsScansAreRead) {
  simulate_room();
  EXPECT_THAT(run_well("info room").out, AllOf(HasSubstr("scans        16\n"),
                                               HasSubstr("depth camera, with its pose"), HasSubstr("from ")));
  EXPECT_THAT(error_of("info room --up z", 2), HasSubstr("folder of scans"));
}

TEST_F(Files, AnOtIsTheMapsOctreeAsOctomapReadsIt) {
  write_floor();
  run_well("map floor -o m");
  EXPECT_THAT(run_well("export m --to m.ot").out, HasSubstr("m.ot: "));
  const std::unique_ptr<octomap::AbstractOcTree> read_back(
      octomap::AbstractOcTree::read((folder / "m.ot").string()));
  const auto* tree = dynamic_cast<const octomap::OcTree*>(read_back.get());
  ASSERT_NE(tree, nullptr);
  EXPECT_GT(tree->getNumLeafNodes(), 1000u);
  expect_same(*tree, *to_octree(load_map(folder / "m").map.octree()));

  EXPECT_THAT(error_of("export m --to m.ot", 2), HasSubstr("m.ot"));  // it is there
  EXPECT_THAT(error_of("export m --to n.ot --what points", 2), HasSubstr("--what"));
  EXPECT_FALSE(exists("n.ot"));
  run_well("map m.ot -o again");
}

TEST_F(Files, InfoTellsTheSameInBothForms) {
  write_floor();
  run_well("map floor -o m");
  const nlohmann::json contents = info("m");
  EXPECT_EQ(contents.at("warnings"), nlohmann::json::array());
  const std::string text = run_well("info m").out;
  EXPECT_THAT(text, AllOf(HasSubstr("resolution   0.02 m\n"), HasSubstr("scans        6, revision"),
                          HasSubstr("surfaces     1,"), HasSubstr("max_hole_size 0.08 m\n")));
  EXPECT_THAT(text, HasSubstr(std::to_string(contents.at("points").get<int>()) + ": "));
}

TEST_F(Files, DamagedMapsAreRefused) {
  write_floor();
  run_well("map floor -o m");
  const std::string whole = read("m.surfaces");
  const auto refused = [&](const std::string& bytes) {
    write("m.surfaces", bytes);
    EXPECT_THAT(error_of("info m", 1), HasSubstr("m.surfaces"));
    EXPECT_THAT(error_of("map floor --resume m", 1), HasSubstr("m.surfaces"));
    EXPECT_TRUE(read("m.surfaces") == bytes);
  };
  refused("");
  refused(whole.substr(0, whole.size() / 2));
}

TEST_F(Files, ABtThatDoesNotMatchIsNamed) {
  write_floor();
  run_well("map floor -o m --first 2");
  write("m.bt", "something else");
  const Outcome looked = run("info m --json");
  EXPECT_EQ(looked.code, 0);
  EXPECT_THAT(looked.err, HasSubstr("m.bt"));
  EXPECT_EQ(nlohmann::json::parse(looked.out).at("warnings").size(), 1u);
  run_well("map floor --resume m --skip 2 --report r.json");
  EXPECT_EQ(read_json("r.json").at("warnings").size(), 1u);
  EXPECT_EQ(info("m").at("warnings").size(), 0u);  // written anew
}

}  // namespace
}  // namespace octosurf::test
