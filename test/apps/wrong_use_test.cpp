// Help, exit codes, and one clear line for everything that is asked for in vain.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class WrongUse : public CommandTest {};

const std::vector<std::string> verbs{"map",   "info",    "export", "view",
                                     "query", "explain", "remap",  "localize"};

TEST_F(WrongUse, HelpOfEveryVerbBeginsWithExamples) {
  for (const std::string& verb : verbs) {
    const std::string help = run_well(verb + " --help").out;
    const auto examples = help.find("Examples:\n  octosurf " + verb), usage = help.find("Usage:");
    EXPECT_NE(usage, std::string::npos) << verb;
    EXPECT_LT(examples, usage) << help;
  }
  for (const std::string verb : {"simulate", "evaluate"})
    EXPECT_THAT(run_well(verb + " --help").out, HasSubstr("Examples:\n  octosurf-lab " + verb));
}

TEST_F(WrongUse, HelpListsTheVerbsALineEach) {
  const std::string help = run_well("--help").out;
  for (const std::string& verb : verbs) EXPECT_THAT(help, HasSubstr("\n  " + verb + " "));
}

TEST_F(WrongUse, VersionIsTold) { EXPECT_EQ(run_well("--version").out, "octosurf " OCTOSURF_VERSION "\n"); }

TEST_F(WrongUse, VerbIsMissingOrUnknown) {
  EXPECT_THAT(error_of("", 2), HasSubstr("verb"));
  EXPECT_THAT(error_of("frobnicate", 2), HasSubstr("'frobnicate' is not a verb"));
  EXPECT_THAT(error_of("--frobnicate", 2), HasSubstr("--frobnicate"));
}

TEST_F(WrongUse, TheLikeliestWordIsSuggested) {
  EXPECT_THAT(error_of("mapp floor", 2), HasSubstr("did you mean map?"));
  EXPECT_THAT(error_of("map floor -o m --resolutoin 0.05", 2), HasSubstr("did you mean --resolution?"));
  EXPECT_THAT(error_of("map floor -o m --reprot=r.json", 2), HasSubstr("did you mean --report?"));
  EXPECT_THAT(error_of("map floor -o m --frobnicate", 2), ::testing::Not(HasSubstr("did you mean")));
}

TEST_F(WrongUse, InfoOfAFolderSaysHowItsScansAreRead) {
  run_well("simulate room -o room --frames 3");
  EXPECT_THAT(run_well("info room").out, AllOf(HasSubstr("scans        3\n"),
                                               HasSubstr("depth camera, with its pose"), HasSubstr("from ")));
  EXPECT_THAT(error_of("info room --check", 2), HasSubstr("folder of scans"));
}

TEST_F(WrongUse, HelpIsAVerb) {
  EXPECT_EQ(run_well("help").out, run_well("--help").out);
  EXPECT_EQ(run_well("help map").out, run_well("map --help").out);
}

TEST_F(WrongUse, OptionsThatMakeNoSense) {
  EXPECT_THAT(error_of("map floor -o m --frobnicate", 2), HasSubstr("--frobnicate"));
  EXPECT_THAT(error_of("map floor -o m --preset best", 2), HasSubstr("--preset"));
  EXPECT_THAT(error_of("map floor -o m --every 0", 2), HasSubstr("--every"));
  EXPECT_THAT(error_of("info", 2), HasSubstr("map is required"));
  write_floor();
  EXPECT_THAT(error_of("map floor -o m --threads 0", 2), HasSubstr("threads"));
  EXPECT_THAT(error_of("map floor -o m --depth-scale -3", 2), HasSubstr("-3"));
  EXPECT_THAT(error_of("map floor -o m --skip 6", 2), HasSubstr("none of the 6 scans"));
  EXPECT_FALSE(exists("m.surfaces"));
}

TEST_F(WrongUse, SimulateTakesASceneOrAMesh) {
  write("step.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n");
  EXPECT_THAT(error_of("simulate -o s", 2), HasSubstr("--mesh"));
  EXPECT_THAT(error_of("simulate room --mesh step.obj -o s", 2), HasSubstr("one of them"));
  EXPECT_THAT(error_of("simulate room --up y -o s", 2), HasSubstr("--up"));
  EXPECT_THAT(error_of("simulate --mesh step.obj --up sky -o s", 2), HasSubstr("'sky' is no axis"));
  EXPECT_THAT(error_of("simulate --mesh step.obj --scale 0 -o s", 2), HasSubstr("scale"));
  EXPECT_THAT(error_of("simulate --mesh steps.obj -o s", 1), HasSubstr("steps.obj: cannot be read"));
  EXPECT_FALSE(exists("s"));
  EXPECT_THAT(run_well("simulate --mesh step.obj -o s --frames 2").out, HasSubstr("triangles        2"));
  EXPECT_TRUE(exists("s/truth.json"));
}

TEST_F(WrongUse, ParametersThatMakeNoSenseAreNamedWithValueAndRule) {
  const auto refused = [&](const std::string& flag, const std::string& name, const std::string& value,
                           const std::string& rule) {
    EXPECT_THAT(error_of("map floor -o m " + flag, 2),
                AllOf(HasSubstr(name), HasSubstr(value), HasSubstr(rule)));
  };
  refused("--resolution -0.5", "resolution", "-0.5", "from 0.001 to 10 m");
  refused("--resolution 0", "resolution", "is 0;", "from 0.001 to 10 m");
  refused("--resolution nan", "resolution", "'nan'", "finite number");
  refused("--resolution 2cm", "resolution", "'2cm'", "finite number");
  refused("--min-surface-points 2", "min_surface_points", "2", "at least 3");
  refused("--min_surface_points 20.5", "min_surface_points", "'20.5'", "integer");
  refused("--smoothness_angle 100", "smoothness_angle", "100", "more than 0 and at most 90 degrees");
  refused("--hit 0.4", "hit", "0.4", "more than 0.5 and less than 1");
  refused("--preserve_surfaces maybe", "preserve_surfaces", "'maybe'", "true or false");
}

TEST_F(WrongUse, WhatFollowsFromAParameterIsSaidOfTheOneThatWasGiven) {
  // The tolerance is half a voxel and more, the normals' radius 2.5 voxels, where they are not given.
  EXPECT_THAT(
      error_of("map floor -o m --resolution 4", 2),
      AllOf(HasSubstr("resolution: is 4"), HasSubstr("surface_tolerance is 2.0"), HasSubstr("at most 1 m")));
  EXPECT_THAT(error_of("map floor -o m --search-radius 0.03", 2),
              AllOf(HasSubstr("search_radius: is 0.03"), HasSubstr("normal_radius is 0.05")));
  EXPECT_THAT(error_of("map floor -o m --search-radius 0.03 --normal-radius 0.04", 2),
              HasSubstr("normal_radius: is 0.04"));
}

TEST_F(WrongUse, BoundsAreSaidInWords) {
  EXPECT_THAT(error_of("map floor -o m --every 0", 2), HasSubstr("--every: '0' must be 1 or more"));
  EXPECT_THAT(error_of("map floor -o m --together 300", 2), HasSubstr("'300' must be from 1 to 256"));
  EXPECT_THAT(error_of("export m --to m.ply --thickness -1", 2), HasSubstr("'-1' must be more than 0"));
  EXPECT_THAT(error_of("plan m --from 0 0 0 0 --to 1 0 0 0 --seconds nan", 2),
              HasSubstr("'nan' must be 0 or more"));
}

TEST_F(WrongUse, InputIsMissingOrForeign) {
  EXPECT_THAT(error_of("map -o m", 2), HasSubstr("INPUT"));
  EXPECT_THAT(error_of("map nowhere -o m", 1), HasSubstr("nowhere: no such file"));
  std::filesystem::create_directory(folder / "empty");
  EXPECT_THAT(error_of("map empty -o m", 1), HasSubstr("empty"));
  write("notes.txt", "buy milk\n");
  EXPECT_THAT(error_of("map notes.txt -o m", 1), HasSubstr("notes.txt"));
  EXPECT_THAT(error_of("info nothing", 1), HasSubstr("nothing.surfaces"));
  EXPECT_THAT(error_of("map --config gone.cfg floor -o m", 1), HasSubstr("gone.cfg"));
  EXPECT_FALSE(exists("m.surfaces"));
}

TEST_F(WrongUse, PosesDoNotMatchOrIntrinsicsAreMissing) {
  write_floor();
  write("five.txt", "0 0 1 1 0 0 0\n0 0 1 1 0 0 0\n0 0 1 1 0 0 0\n0 0 1 1 0 0 0\n0 0 1 1 0 0 0\n");
  EXPECT_THAT(error_of("map floor -o m --poses five.txt", 1),
              AllOf(HasSubstr("five.txt"), HasSubstr("5"), HasSubstr("6")));
  std::filesystem::remove(folder / "floor/intrinsics.txt");
  EXPECT_THAT(error_of("map floor -o m", 1), AllOf(HasSubstr("floor"), HasSubstr("--intrinsics")));
  EXPECT_FALSE(exists("m.surfaces"));
}

TEST_F(WrongUse, OutputsAreNotOverwrittenSilently) {
  write_floor();
  write("m.surfaces", "precious");
  EXPECT_THAT(error_of("map floor -o m", 2), AllOf(HasSubstr("m.surfaces"), HasSubstr("--force")));
  EXPECT_EQ(read("m.surfaces"), "precious");
  write("other.bt", "precious");
  EXPECT_THAT(error_of("map floor -o other", 2), AllOf(HasSubstr("other.bt"), HasSubstr("--force")));
  write("report.json", "precious");
  EXPECT_THAT(error_of("map floor -o third --report report.json", 2),
              AllOf(HasSubstr("report.json"), HasSubstr("--force")));
  EXPECT_EQ(read("report.json"), "precious");
  EXPECT_FALSE(exists("third.surfaces"));
  run_well("map floor -o m --report report.json --force");
  EXPECT_EQ(info("m").at("scans"), 6);
  EXPECT_EQ(read_json("report.json").at("scans"), 6);
}

TEST_F(WrongUse, OutputCannotBeWritten) {
  write_floor();
  write("file", "");
  EXPECT_THAT(error_of("map floor", 2), HasSubstr("-o"));
  EXPECT_THAT(error_of("map floor -o maps/", 2), HasSubstr("maps/"));
  EXPECT_THAT(error_of("map floor -o file/m", 1), HasSubstr("file/m"));
  EXPECT_THAT(error_of("map floor -o m --report missing/r.json", 1), HasSubstr("missing/r.json"));
  EXPECT_FALSE(exists("m.surfaces"));
}

}  // namespace
}  // namespace octosurf::test
