// Parameters by file and flag.
#include "apps/command.hpp"

#include <gmock/gmock.h>
#include <sstream>

#include <octosurf/parameters.hpp>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Config : public CommandTest {
 protected:
  /// name → rest of the line that --show-parameters prints.
  std::map<std::string, std::string> shown(const std::string& arguments) const {
    std::map<std::string, std::string> values;
    std::istringstream lines(run_well("map --show-parameters " + arguments).out);
    for (std::string line; std::getline(lines, line);)
      values[line.substr(0, line.find(' '))] = line.substr(line.find(' ') + 1);
    return values;
  }
};

TEST_F(Config, ShowsWhatIsInForce) {
  auto values = shown("");
  EXPECT_EQ(values.size(), 24u);
  EXPECT_EQ(values["align"], "auto");
  EXPECT_EQ(values["resolution"], "0.02 m");
  EXPECT_EQ(values["max_hole_size"], "0.08 m");
  values = shown("--resolution 0.05");
  EXPECT_EQ(values["max_hole_size"], "0.2 m");  // 4 d
  EXPECT_EQ(shown("--resolution 0.05 --max-hole-size 0.08")["max_hole_size"], "0.08 m");
}

TEST_F(Config, ThePapersDetectorBringsThePapersValues) {
  const Parameters paper = Parameters::paper(0.05, 0.01);
  auto values = shown("--detector paper --resolution 0.05 --sensor-noise 0.01");
  for (const ParameterInfo& info : parameter_infos())
    EXPECT_EQ(values[info.name],
              get_parameter(paper, info.name) + (info.unit.empty() ? "" : " " + info.unit));
  EXPECT_EQ(shown("--detector paper")["surface_tolerance"], "0.039641 m");  // 0.005 + 0.02 √3
  EXPECT_EQ(shown("--detector paper --resolution 0.01")["surface_tolerance"],
            "0.0223205 m");  // 0.005 + 0.01 √3
  EXPECT_EQ(shown("--detector paper --sensor-noise 0.01")["surface_tolerance"], "0.044641 m");
  EXPECT_EQ(shown("--detector paper --surface-tolerance 0.03 --resolution 0.01")["surface_tolerance"],
            "0.03 m");
  EXPECT_EQ(shown("--align auto --detector paper")["align"], "auto");
}

TEST_F(Config, FlagsWinOverFileOverTheDetectorsValues) {
  write("o.cfg", "# coarse\nresolution = 0.04\r\n\n  min-surface-points=30  # few\nsearch_radius = auto\n");
  const auto values = shown("--detector paper --config o.cfg --resolution 0.03");
  EXPECT_EQ(values.at("resolution"), "0.03 m");
  EXPECT_EQ(values.at("min_surface_points"), "30");
  EXPECT_EQ(values.at("search_radius"), "0.15 m");   // derived again: 5 d
  EXPECT_EQ(values.at("min_surface_width"), "0 m");  // the paper's
}

TEST_F(Config, FileAndLineOfAMistakeAreNamed) {
  const auto mistake = [&](const std::string& content) {
    write("o.cfg", content);
    return error_of("map --show-parameters --config o.cfg", 2);
  };
  EXPECT_THAT(mistake("# x\nresolutoin = 0.04\n"), AllOf(HasSubstr("o.cfg:2"), HasSubstr("resolutoin")));
  EXPECT_THAT(mistake("resolution = fine\n"), AllOf(HasSubstr("o.cfg:1"), HasSubstr("'fine'")));
  EXPECT_THAT(mistake("resolution 0.04\n"), AllOf(HasSubstr("o.cfg:1"), HasSubstr("name = value")));
  EXPECT_THAT(mistake("resolution = -1\n"), HasSubstr("from 0.001 to 10 m"));
}

TEST_F(Config, TheMapIsMadeWithThem) {
  write_floor();
  write("o.cfg", "resolution = 0.04\n");
  run_well("map floor -o m --first 1 --config o.cfg --min_range 0.25 --report r.json");
  const nlohmann::json parameters = read_json("r.json").at("parameters");
  EXPECT_EQ(parameters.at("resolution"), 0.04);
  EXPECT_EQ(parameters.at("min_range"), 0.25);
  EXPECT_EQ(parameters.at("preserve_surfaces"), true);
  EXPECT_EQ(parameters.at("max_range"), "sensor");
  EXPECT_EQ(info("m").at("parameters"), parameters);
}

}  // namespace
}  // namespace octosurf::test
