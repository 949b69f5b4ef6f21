// Parameters by file and flag, and up: given, estimated, and asked for otherwise than the map has it.
#include "apps/command.hpp"
#include "options/parameter_options.hpp"

#include <CLI/CLI.hpp>
#include <numbers>
#include <sstream>

#include <octosurf/parameters.hpp>

namespace octosurf::test {
namespace {

class Config : public CommandTest {
 protected:
  /// name → value of the parameters that these options set.
  std::map<std::string, std::string> in_force(const std::string& arguments) const {
    CLI::App verb;
    ParameterOptions options;
    add_parameter_options(verb, options);
    verb.parse(arguments);
    if (!options.config.empty()) options.config = folder / options.config;
    const Parameters parameters = ParameterChoice(options).in_force();
    std::map<std::string, std::string> values;
    for (const ParameterInfo& info : parameter_infos())
      values[info.name] = get_parameter(parameters, info.name);
    return values;
  }
};

TEST_F(Config, WhatIsNotGivenIsDerived) {
  auto values = in_force("");
  EXPECT_EQ(values.size(), 23u);
  EXPECT_EQ(values["align"], "auto");
  EXPECT_EQ(values["resolution"], "0.02");
  EXPECT_EQ(values["max_hole_size"], "0.08");
  EXPECT_EQ(in_force("--resolution 0.05")["max_hole_size"], "0.2");  // 4 d
  EXPECT_EQ(in_force("--resolution 0.05 --max-hole-size 0.08")["max_hole_size"], "0.08");
}

TEST_F(Config, ThePapersDetectorBringsThePapersValues) {
  const Parameters paper = Parameters::paper(0.05, 0.01);
  auto values = in_force("--detector paper --resolution 0.05 --sensor-noise 0.01");
  for (const ParameterInfo& info : parameter_infos())
    EXPECT_EQ(values[info.name], get_parameter(paper, info.name));
  for (const auto& [flags, tolerance] : {std::pair("", "0.039641"),           // 0.005 + 0.02 √3
                                         {"--resolution 0.01", "0.0223205"},  // 0.005 + 0.01 √3
                                         {"--sensor-noise 0.01", "0.044641"},
                                         {"--surface-tolerance 0.03 --resolution 0.01", "0.03"}})
    EXPECT_EQ(in_force(std::string("--detector paper ") + flags)["surface_tolerance"], tolerance);
  EXPECT_EQ(in_force("--align auto --detector paper")["align"], "auto");
}

TEST_F(Config, FlagsWinOverFileOverTheDetectorsValues) {
  write("o.cfg", "# coarse\nresolution = 0.04\r\n\n  min-surface-points=30  # few\nsearch_radius = auto\n");
  const auto values = in_force("--detector paper --config o.cfg --resolution 0.03");
  EXPECT_EQ(values.at("resolution"), "0.03");
  EXPECT_EQ(values.at("min_surface_points"), "30");
  EXPECT_EQ(values.at("search_radius"), "0.15");   // derived again: 5 d
  EXPECT_EQ(values.at("min_surface_width"), "0");  // the paper's
}

TEST_F(Config, FileAndLineOfAMistakeAreNamed) {
  const std::vector<std::pair<std::string, Words>> mistakes{
      {"# x\nresolutoin = 0.04\n", {"o.cfg:2", "resolutoin"}},
      {"resolution = fine\n", {"o.cfg:1", "'fine'"}},
      {"resolution 0.04\n", {"o.cfg:1", "name = value"}},
      {"resolution = -1\n", {"from 0.001 to 10 m"}}};
  for (const auto& [content, words] : mistakes) {
    write("o.cfg", content);
    wrong_use("map floor -o m --config o.cfg", words);
  }
}

TEST_F(Config, TheMapIsMadeWithThem) {
  write_floor();
  write("o.cfg", "resolution = 0.04\n");
  run_well("map floor -o m --first 1 --config o.cfg --min_range 0.25 --report r.json");
  const json parameters = read_json("r.json").at("parameters");
  EXPECT_EQ(parameters.at("resolution"), 0.04);
  EXPECT_EQ(parameters.at("min_range"), 0.25);
  EXPECT_EQ(parameters.at("preserve_surfaces"), true);
  EXPECT_EQ(parameters.at("max_range"), "sensor");
  EXPECT_EQ(info("m").at("parameters"), parameters);
}

class UpOption : public FloorTest {
 protected:
  json up_of(const std::string& map, const std::string& more = {}) const {
    return json_of("info " + map + " --json " + more).at("up");
  }
};

TEST_F(UpOption, GivenInEveryWay) {
  EXPECT_EQ(up_of("m").at("direction"), json({0.0, 0.0, 1.0}));
  write("o.cfg", "up = 0 -1 0\n");
  for (const char* up : {"--up -y", "--up 0 -2 0", "--up=-y", "--up 0,-2,0", "--config o.cfg"}) {
    run_well(std::string("map floor --force -o o --first 1 ") + up);
    EXPECT_EQ(up_of("o").at("direction"), json({0.0, -1.0, 0.0})) << up;
    EXPECT_EQ(up_of("o").at("from"), "given");
  }
  run_well("map floor --resume m --first 1 --up auto");  // what is gone on with may get another
  EXPECT_EQ(up_of("m").at("from"), "surfaces");
  run_well("map floor -o n --resume m");
  EXPECT_EQ(up_of("n").at("from"), "surfaces") << "kept";
}

TEST_F(UpOption, AutoIsToldInReportAndInfo) {
  EXPECT_THAT(run_well("map floor -o m --force --up auto --report r.json").out, says("estimated from"));
  const json up = read_json("r.json").at("up");
  EXPECT_EQ(up.at("from"), "surfaces");
  EXPECT_NEAR(up.at("direction").at(2), 1, 1e-6);
  EXPECT_EQ(read_json("r.json").at("parameters").at("up_z"), "estimated");
  EXPECT_EQ(up_of("m"), up);
  EXPECT_THAT(run_well("info m").out, says("from surfaces"));
}

TEST_F(UpOption, AskedForOtherwise) {
  for (const auto& [up, slope_deg] : {std::pair("", 0), {"--up x", 90}, {"--up -z", 180}, {"--up auto", 0}})
    EXPECT_NEAR(ask(up, "info").at("largest").at(0).at("slope_deg"), slope_deg, 0.01) << up;
  EXPECT_EQ(up_of("m", "--up auto").at("from"), "surfaces");
  const auto picture = [&](const std::string& up) {
    run_well("view m --force --png m.png --width 64 --height 64 " + up);
    return read("m.png");
  };
  EXPECT_EQ(picture(""), picture("--up 0 0 1"));
  EXPECT_NE(picture(""), picture("--up -y"));
}

TEST_F(UpOption, AnotherAxisIsSuggestedWhereSurfacesAndSensorsAgree) {
  // In a frame whose y is up: a floor of 3.6 m², seen by cameras that look down, and a wall of 4.7 m², level
  // to z, seen by twice as many that are held upright.
  write_floor("corner", 12);
  std::ostringstream poses;
  for (int i = 0; i < 4; ++i) poses << 0.8 * i << " 1 0 0.70710678 0 0 0.70710678\n";  // look along -y
  for (int i = 0; i < 8; ++i) poses << 0.5 * i << " 1.5 0 1 0 0 0\n";                  // along -z
  write("corner/poses.txt", poses.str());
  const std::string suggestion = "that up is y, not z";
  EXPECT_THAT(run_well("map corner -o y").err, says(suggestion));
  EXPECT_THAT(run_well("view y --png y.png").err, says(suggestion));
  EXPECT_THAT(run("view y --html y.html").err, says(suggestion));  // with a page or without
  EXPECT_THAT(run_well("view y --png auto.png --up auto").err, Not(HasSubstr("suggest")));
  EXPECT_THAT(run_well("map floor -o z").err, Not(HasSubstr("suggest")));
}

}  // namespace
}  // namespace octosurf::test
