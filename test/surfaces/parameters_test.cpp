#include "support/paths.hpp"
#include "support/testing.hpp"

#include <octomap/octomap.h>

namespace octosurf::surfaces {
namespace {

using ::testing::HasSubstr;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

TEST(Parameters, OccupancyDefaultsAreOctomaps) {
  const OccupancyParameters p;
  const octomap::OcTree tree(0.1);
  EXPECT_NEAR(p.hit, tree.getProbHit(), 1e-4);
  EXPECT_NEAR(p.miss, tree.getProbMiss(), 1e-4);
  EXPECT_NEAR(p.clamp_min, tree.getClampingThresMin(), 1e-4);
  EXPECT_NEAR(p.clamp_max, tree.getClampingThresMax(), 1e-4);
  EXPECT_NEAR(p.occupied, tree.getOccupancyThres(), 1e-4);
}

TEST(Parameters, TextGoesInAndOut) {
  Parameters p;
  const auto check = [&](const std::string& name, const std::string& text, const std::string& back) {
    set_parameter(p, name, text);
    EXPECT_EQ(get_parameter(p, name), back);
  };
  check("resolution", "0.04", "0.04");
  check("resolution", "4e-2", "0.04");
  check("min_surface_points", "120", "120");
  EXPECT_EQ(p.detection.min_surface_points, 120);
  check("preserve_surfaces", "false", "false");
  EXPECT_FALSE(p.occupancy.preserve_surfaces);
  check("max_range", "7.5", "7.5");
  check("max_range", "auto", "sensor");
  EXPECT_FALSE(p.occupancy.max_range);
  check("range_noise", "0.001", "0.001");
  check("range_noise", "auto", "estimated");
  set_parameter(p, "surface_tolerance", "0.5");
  set_parameter(p, "surface_tolerance", "auto");
  EXPECT_EQ(p.surface_tolerance(), Parameters([&] {
                                     Parameters fresh;
                                     fresh.occupancy.resolution = 0.04;
                                     return fresh;
                                   }())
                                       .surface_tolerance());
}

TEST(Parameters, UpIsThreeNumbersAnAxisOrAuto) {
  const auto up_of_text = [](const std::string& text) {
    Parameters p;
    set_parameter(p, "up", text);
    p.validate();
    return p.up;
  };
  EXPECT_EQ(Parameters{}.up, Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(up_of_text("y"), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(up_of_text("+x"), Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(up_of_text("-z"), Eigen::Vector3d(0, 0, -1));
  EXPECT_EQ(up_of_text("0 -2 0"), Eigen::Vector3d(0, -1, 0));
  EXPECT_TRUE(up_of_text("3, 0,-4")->isApprox(Eigen::Vector3d(0.6, 0, -0.8), 1e-15));
  EXPECT_TRUE(up_of_text("1e300 0 1e300")->isApprox(Eigen::Vector3d(1, 0, 1).normalized(), 1e-15));
  EXPECT_EQ(up_of_text("auto"), std::nullopt);
  Parameters p;
  for (const char* text : {"", "w", "--y", "yy", "0 0 0", "1 2", "1 2 3 4", "nan 0 1", "inf 0 0", "1 2 z"}) {
    EXPECT_THROW(set_parameter(p, "up", text), Error) << text;
    EXPECT_EQ(p.up, Eigen::Vector3d(0, 0, 1)) << "changed all the same by " << text;
  }
  set_parameter(p, "up", "0 3 -4");
  EXPECT_EQ(get_parameter(p, "up"), "0 0.6 -0.8");
  EXPECT_EQ(parameter_value(p, "up_z"), -0.8);
  set_parameter(p, "up", "auto");
  EXPECT_EQ(get_parameter(p, "up"), "estimated");
  EXPECT_EQ(parameter_value(p, "up_x"), std::nullopt);
  for (const Eigen::Vector3d& wrong : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, 0, 1.01),
                                       Eigen::Vector3d(nan, 0, 1), Eigen::Vector3d(inf, 0, 0)}) {
    p.up = wrong;
    EXPECT_THROW(p.validate(), Error) << wrong.transpose();
  }
}

TEST(Parameters, TextThatIsNoValueIsRefused) {
  for (const ParameterInfo& info : parameter_infos())
    for (const char* text : {"", " ", "nan", "inf", "-inf", "1e999", "0.1m", "0,1", "0x10", "one", "1 2"}) {
      Parameters p;
      try {
        set_parameter(p, info.name, text);
        ADD_FAILURE() << info.name << " took '" << text << "'";
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), Error::Kind::usage);
        EXPECT_THAT(error.what(), HasSubstr(info.name));
        EXPECT_THAT(error.what(), HasSubstr(text));
      }
      EXPECT_EQ(parameter_value(p, info.name), parameter_value(Parameters{}, info.name))
          << "changed all the same";
    }
  Parameters p;
  EXPECT_THROW(set_parameter(p, "min_surface_points", "50.5"), Error);
  EXPECT_THROW(set_parameter(p, "resolution", "auto"), Error);
  for (const char* name : {"resolutoin", "", "Resolution"}) {
    EXPECT_THROW(set_parameter(p, name, "1"), Error);
    EXPECT_THROW(get_parameter(p, name), Error);
    EXPECT_THROW(parameter_value(p, name), Error);
    EXPECT_THROW(set_parameter_value(p, name, 1), Error);
  }
}

/// That exact values come back is MapFileTest.ParametersComeBackExactly's.
TEST(Parameters, NumbersThatAreNoValueAreRefused) {
  Parameters p;
  EXPECT_THROW(set_parameter_value(p, "resolution", std::nullopt), Error) << "never derived";
  for (const double no_count : {std::nan(""), 1e300, -1e300, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(set_parameter_value(p, "min_surface_points", no_count), Error);
    EXPECT_THROW(set_parameter_value(p, "preserve_surfaces", no_count), Error);
  }
  for (const double no_choice : {-1.0, 0.5, 2.0, std::nan("")}) {
    EXPECT_THROW(set_parameter_value(p, "detector", no_choice), Error);
    EXPECT_THROW(set_parameter_value(p, "align", no_choice), Error);
  }
  p.detection.detector = static_cast<DetectorKind>(7);
  EXPECT_THROW(p.validate(), Error);
}

/// Rows of docs/parameters.md's table: name → cells behind it.
std::map<std::string, std::vector<std::string>> documented() {
  std::ifstream file(test::paths::source() + "/docs/parameters.md");
  std::map<std::string, std::vector<std::string>> rows;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("| `")) continue;
    std::vector<std::string> cells;
    std::istringstream parts(line.substr(1));
    for (std::string cell; std::getline(parts, cell, '|');) {
      const auto first = cell.find_first_not_of(" `"), last = cell.find_last_not_of(" `");
      cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
    }
    EXPECT_TRUE(rows.emplace(cells.at(0), std::vector(cells.begin() + 1, cells.end())).second) << line;
  }
  return rows;
}

TEST(Parameters, TheDocumentationHasThemAllAsTheyAre) {
  auto rows = documented();
  const Parameters defaults, paper = Parameters::paper();
  for (const ParameterInfo& info : parameter_infos()) {
    ASSERT_TRUE(rows.contains(info.name)) << info.name << " is not in docs/parameters.md";
    const std::vector<std::string> cells = rows[info.name];
    ASSERT_EQ(cells.size(), 5u) << info.name;
    EXPECT_EQ(cells[0], info.unit) << info.name;
    const bool derived = !parameter_value(defaults, info.name);
    if (!derived) {
      EXPECT_EQ(cells[1], get_parameter(defaults, info.name)) << info.name;
    }
    const bool papers = parameter_value(paper, info.name) != parameter_value(defaults, info.name);
    EXPECT_EQ(!cells[2].empty(), papers) << info.name << ": the paper's column";
    if (papers && info.name != "surface_tolerance" && info.name != "search_radius") {  // formulas there
      EXPECT_EQ(cells[2], get_parameter(paper, info.name)) << info.name;
    }
    EXPECT_FALSE(cells[3].empty() || info.help.empty()) << info.name;
    rows.erase(info.name);
  }
  EXPECT_TRUE(rows.empty()) << rows.begin()->first << " is documented but is no parameter";
}

/// The formulas of docs/parameters.md, unless a value is given.
TEST(Parameters, DerivedValuesAreWhatTheDocumentationSays) {
  for (const double d : {0.001, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.5}) {
    Parameters p;
    p.occupancy.resolution = d;
    EXPECT_NO_THROW(p.validate()) << d;
    EXPECT_NEAR(p.surface_tolerance(), p.surfaces.sensor_noise + d / 2, 1e-12);
    EXPECT_NEAR(p.max_hole_size(), std::max(0.08, 4 * d), 1e-12);
    EXPECT_NEAR(p.search_radius(), std::max(0.06, 5 * d), 1e-12);
    EXPECT_EQ(p.min_surface_points(), std::clamp(static_cast<int>(std::lround(0.02 / (d * d))), 20, 500));
    const Parameters paper = Parameters::paper(d, 0.01);
    EXPECT_NO_THROW(paper.validate()) << d;
    EXPECT_EQ(paper.occupancy.resolution, d);
    EXPECT_EQ(paper.surfaces.sensor_noise, 0.01);
    EXPECT_NEAR(paper.surface_tolerance(), 0.01 + d * std::sqrt(3.0), 1e-12);
    EXPECT_NEAR(paper.max_hole_size(), std::max(0.08, 4 * d), 1e-12);
    EXPECT_NEAR(paper.search_radius(), std::clamp(0.15, 5 * d, 64 * d), 1e-12);
    EXPECT_EQ(paper.min_surface_points(), 50);
  }
  Parameters given;
  given.surfaces.surface_tolerance = 0.033;
  given.surfaces.max_hole_size = 0.3;
  given.detection.search_radius = 0.21;
  given.detection.min_surface_points = 77;
  EXPECT_EQ((std::array{given.surface_tolerance(), given.max_hole_size(), given.search_radius(),
                        1.0 * given.min_surface_points()}),
            (std::array{0.033, 0.3, 0.21, 77.0}));
}

/// Values out of range for each parameter. The message names parameter, value and rule.
TEST(Parameters, ValidateNamesFieldValueAndRule) {
  const std::vector<std::pair<std::string, std::vector<double>>> refused{
      {"resolution", {0, -0.02, 1e9}},
      {"max_range", {0, -1}},
      {"min_range", {-0.1}},
      {"hit", {0.5, 0, 1, 1.5}},
      {"miss", {0.5, 0, 1, -0.4}},
      {"clamp_min", {0, -1, 0.6, 1}},
      {"clamp_max", {1, 1.2, 0.4, 0}},
      {"occupied", {0, 1, -1}},
      {"sensor_noise", {-0.001, 1e6}},
      {"range_noise", {-0.001, 1e6}},
      {"surface_tolerance", {0, -0.01, 1e6}},
      {"max_hole_size", {0, -1, 0.001, 0.65, 1e6}},
      {"min_surface_width", {-0.01, 1e6}},
      {"search_radius", {0, -0.15, 1e6}},
      {"min_surface_points", {0, -50, 2}},
  };
  for (const auto& [name, values] : refused) {
    std::vector<double> all = values;
    const bool real = name != "min_surface_points";
    if (real) all.insert(all.end(), {nan, inf, -inf});
    for (const double value : all) {
      if (name == "max_range" && value == inf) continue;  // may well mean "no limit"
      Parameters p;
      set_parameter_value(p, name, value);
      try {
        p.validate();
        ADD_FAILURE() << name << " = " << value << " was accepted";
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), Error::Kind::usage);
        // 'occupied' may be reported by way of a clamp it no longer lies between.
        if (name != "occupied" && name != "resolution") {
          EXPECT_EQ(error.where(), name) << error.what();
        }
        EXPECT_THAT(error.what(), HasSubstr("must be"));
        EXPECT_THAT(error.what(), HasSubstr(get_parameter(p, error.where())));
      }
    }
  }
  Parameters p;
  p.occupancy.min_range = 3;
  p.occupancy.max_range = 2;
  EXPECT_THROW(p.validate(), Error);
}

}  // namespace
}  // namespace octosurf::surfaces
