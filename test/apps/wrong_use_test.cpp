// Help, exit codes, one clear line for everything that is asked for in vain, and parameters by file and flag.
#include "apps/command.hpp"
#include "options/parameter_options.hpp"

#include <CLI/CLI.hpp>

namespace octosurf::test {
namespace {

class WrongUse : public FloorTest {
 protected:
  /// Of all files but what a run has said.
  std::map<fs::path, std::string> contents() const {
    std::map<fs::path, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file() && !entry.path().filename().string().starts_with("."))
        all[entry.path()] = read_file(entry.path());
    return all;
  }
};

TEST_F(WrongUse, HelpBeginsWithExamplesAndListsTheVerbsALineEach) {
  const std::string all = run_well("--help").out;
  for (const std::string verb :
       {"map", "info", "export", "view", "query", "explain", "remap", "localize", "simulate", "evaluate"}) {
    const bool of_lab = verb == "simulate" || verb == "evaluate";
    const std::string help = run_well(verb + " --help").out;
    const auto examples = help.find("Examples:\n  octosurf" + std::string(of_lab ? "-lab " : " ") + verb);
    EXPECT_LT(examples, help.find("Usage:")) << help;
    EXPECT_NE(help.find("Usage:"), std::string::npos) << verb;
    if (!of_lab) {
      EXPECT_THAT(all, says("\n  " + verb + " "));
    }
  }
  EXPECT_EQ(run_well("help").out, all);
  EXPECT_EQ(run_well("help map").out, run_well("map --help").out);
  EXPECT_EQ(run_well("--version").out, "octosurf " OCTOSURF_VERSION "\n");
}

TEST_F(WrongUse, HelpOfMapListsWhatOneSetsAndNamesTheRest) {
  const std::string help = run_well("map --help").out;
  std::istringstream lines(help);
  int listed = 0;
  for (std::string line; std::getline(lines, line);) listed += line.starts_with("  -");
  EXPECT_LE(listed, 48);
  for (const ParameterInfo& info : parameter_infos()) {
    if (info.name.starts_with("up_")) continue;
    std::string flag = info.name;
    std::replace(flag.begin(), flag.end(), '_', '-');
    EXPECT_THAT(help, says(flag));
    wrong_use("map floor -o n --" + flag + " none", {info.name});
  }
}

struct Refused {
  std::string arguments;
  std::vector<std::string> words;  ///< all of them in the line
  int code = 2;
};

/// In a folder with the scans `floor`, their map `m`, its other names, what else they name, and the empty
/// folder `empty`.
const std::vector<Refused>& refused() {
  static const std::string foothold = "query m --foothold 0 0 0 0",
                           plan = "plan m --from 0 0 0 0 --to 1 0 0 0";
  static const std::vector<Refused> table{
      {"", {"verb"}},
      {"frobnicate", {"'frobnicate' is not a verb"}},
      {"--frobnicate", {"--frobnicate"}},
      {"mapp floor", {"'mapp' is not a verb", "--help"}},
      {"info", {"map is required"}},
      {"info nothing", {"nothing.surfaces"}, 1},
      // map: options and bounds
      {"map floor -o n --resolutoin 0.05", {"--resolutoin", "octosurf map --help"}},
      {"map floor -o n --every 0", {"--every: '0' must be 1 or more"}},
      {"map floor -o n --threads 0", {"threads"}},
      {"map floor -o n --depth-scale -3", {"-3"}},
      {"map floor -o n --skip 6", {"none of the 6 scans"}},
      {"map floor -o n --checkpoint -1", {"--checkpoint"}},
      {"map floor -o n --checkpoint often", {"--checkpoint"}},
      {"map floor -o n --checkpoint ''", {"--checkpoint"}},
      {"map floor -o n --up 0 0 0", {"up"}},
      {"map floor -o n --up down", {"'down'"}},
      {"map floor -o m --force --report m.lock", {"--report m.lock", "give another name"}},
      {"map floor -o m --resume m --write-poses m.lock", {"--write-poses m.lock"}},
      {"export m --to m.lock --force", {"--to m.lock"}},
      {"view m --html m.lock --force", {"m.lock"}},
      {"map floor -o n --report n.surfaces", {"--report"}},
      {"map floor -o n --report ./n.bt", {"--report"}},
      {"map floor -o n --report here/n.bt", {"--report"}},
      {"map floor -o n --report floor/../n.surfaces", {"--report"}},
      {"map floor -o m --force --report m.surfaces", {"--report"}},
      {"map floor -o m --force --report m.bt", {"--report"}},
      {"map floor -o m --force --report hard.json", {"--report"}},
      {"map floor -o m --force --report soft.json", {"--report"}},
      {"map floor -o n --force --resume m --report m.surfaces", {"--report"}},
      {"evaluate m --truth truth.json --force --json m.surfaces", {"--json"}},
      {"evaluate m --truth truth.json --force --json hard.json", {"--json"}},
      {"evaluate m --truth truth.json --force --json truth.json", {"--json"}},
      {"view m --force --png m.bt", {"--png"}},
      {"map floor -o n --force --report floor/poses.txt", {"floor/poses.txt"}},
      {"map floor -o n --force --report ./floor/1.pgm", {"floor/1.pgm"}},
      {"map floor -o n --force --poses five.txt --report five.txt", {"five.txt"}},
      {"map floor -o n --force --intrinsics K.txt --report K.txt", {"K.txt"}},
      {"map floor -o n --force --config c.txt --report c.txt", {"c.txt"}},
      {"map m.bt -o n --force --report m.bt", {"m.bt"}},
      {"map m.bt -o m --force", {"m.bt"}},
      {"map floor -o n --max-hole-size 5", {"max_hole_size", "from 1 to 32 voxels"}},
      {"map floor -o n --viewpoint 0 0 1", {"has a pose already"}},
      {"map floor -o n --detector best", {"likelihood or paper"}},
      // map: parameters, with value and rule
      {"map floor -o n --resolution -0.5", {"resolution", "-0.5", "from 0.001 to 10 m"}},
      {"map floor -o n --resolution 0", {"resolution", "is 0;", "from 0.001 to 10 m"}},
      {"map floor -o n --resolution nan", {"resolution", "'nan'", "finite number"}},
      {"map floor -o n --min-surface-points 2", {"min_surface_points", "2", "at least 3"}},
      {"map floor -o n --min_surface_points 20.5", {"min_surface_points", "'20.5'", "integer"}},
      {"map floor -o n --hit 0.4", {"hit", "0.4", "more than 0.5 and less than 1"}},
      {"map floor -o n --preserve_surfaces maybe", {"preserve_surfaces", "'maybe'", "true or false"}},
      // what follows from a parameter is said of the one that was given
      {"map floor -o n --resolution 4", {"resolution: is 4", "surface_tolerance is 2.0", "at most 1 m"}},
      // map: inputs and outputs
      {"map -o n", {"input"}},
      {"map floor", {"-o"}},
      {"map floor -o maps/", {"maps/"}},
      {"map nowhere -o n", {"nowhere: no such file"}, 1},
      {"map m -o n", {"a saved map", "--resume"}, 1},
      {"map empty -o n", {"empty"}, 1},
      {"map notes.txt -o n", {"notes.txt"}, 1},
      {"map --config gone.cfg floor -o n", {"gone.cfg"}, 1},
      {"map floor -o notes.txt/n", {"notes.txt/n"}, 1},
      {"map floor -o n --report missing/r.json", {"missing/r.json"}, 1},
      {"map floor -o m", {"m.surfaces", "--force"}},
      {"map floor -o other", {"other.bt", "--force"}},
      {"map floor -o n --report truth.json", {"truth.json", "--force"}},
      {"export m --to run.mcap", {"run.mcap", "--force"}},
      {"map floor -o n --poses far.txt", {"0.pgm", "1e+30"}, 1},
      {"map floor -o n --poses five.txt", {"five.txt", "5", "6"}, 1},
      // explain and query
      {"explain m", {"--at"}},
      {"explain m --at 1 2", {"--at"}},
      {"explain nothing --at 1 2 3", {"nothing.surfaces"}, 1},
      {"query m", {}},
      {"query m --below 0 0 1 --nearest 0 0 1", {}},
      {"query m --below 0 0 -1", {"below"}, 1},
      {"query m --nearest 0 0 1 --up x --max-slope 45", {"--max-slope"}, 1},
      {"query m --ray 0 0 0 0 0 0", {"direction"}},
      {"query m --voxel 0 0 0 --sphere 0 0 0 1", {"--"}},
      {"query m --foothold 0 0 0", {}},
      {foothold + " --foot 0.2y0.1", {"--foot"}},
      {foothold + " --foot 0x1", {"rectangle"}},
      {foothold + " --clearance 0 --obstacle-margin 0.1", {"clearance"}},
      {foothold + " --clearance -1", {"-1"}},
      {"query m --regions 4711", {"4711"}, 1},
      {"query m --regions 1 --below 0 0 1", {}},
      // plan
      {"plan m --from 0 0 0 --to 1 1 1 0", {"--from"}},
      {plan + " --foot big", {"--foot big"}},
      {plan + " -o plan.txt", {".json"}},
      {"plan nothing --from 0 0 0 0 --to 1 0 0 0", {"nothing.surfaces"}, 1},
      // export and view
      {"export m --to n.ply --thickness -1", {"'-1' must be more than 0"}},
      {"export m n.json", {"--to is required"}},
      {"export m --to n.ot --what points", {"--what"}},
      {"export m --to n.pcd", {"no such format", ".json, .ply, .glb, .ot or .mcap", "Nav2"}},
      {"export m --to n.mcap --what points", {"--what"}},
      {"view m --png n.png --up 0 0 0", {"up"}},
      // simulate: a scene or a mesh
      {"simulate -o s", {"--mesh"}},
      {"simulate room --mesh step.obj -o s", {"one of them"}},
      {"simulate room --up y -o s", {"--up"}},
      {"simulate --mesh step.obj --up sky -o s", {"'sky' is no axis"}},
      {"simulate --mesh step.obj --scale 0 -o s", {"scale"}},
      {"simulate --mesh steps.obj -o s", {"steps.obj: cannot be read"}, 1},
  };
  return table;
}

TEST_F(WrongUse, IsSaidInOneLineAndLeavesNothing) {
  write("notes.txt", "buy milk\n");
  write("step.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n");
  fs::create_directory(folder / "empty");
  std::vector<Eigen::Isometry3d> poses = floor_poses();
  poses[0].translation().x() = 1e30;
  write_poses("far.txt", poses);
  write_poses("five.txt", floor_poses(5));
  for (const char* taken : {"truth.json", "other.bt", "run.mcap"}) write(taken, "{}");
  write("c.txt", "resolution = 0.02\n");
  fs::create_directory_symlink(folder, folder / "here");
  fs::create_hard_link(folder / "m.surfaces", folder / "hard.json");
  fs::create_symlink("m.bt", folder / "soft.json");
  fs::copy_file(folder / "floor/intrinsics.txt", folder / "K.txt");
  const auto before = contents();
  for (const Refused& one : refused()) {
    ends(one.arguments, one.code, one.words);
    ASSERT_TRUE(contents() == before) << one.arguments;
  }
  run_well("map floor -o n --report floor/new.json");  // a file of its own may stand there
  run_well("map floor -o other --report truth.json --force");
  EXPECT_EQ(info("other").at("scans"), 6);
  EXPECT_EQ(read_json("truth.json").at("scans"), 6);
  fs::remove(folder / "floor/intrinsics.txt");
  fails("map floor -o o", {"floor", "--intrinsics"});
  EXPECT_FALSE(exists("o.surfaces") || exists("s"));
  EXPECT_THAT(run_well("simulate --mesh step.obj -o s --frames 2").out, says("triangles        2"));
  EXPECT_TRUE(exists("s/truth.json"));
}

/// Every option that takes numbers, as each verb's help lists them.
TEST_F(WrongUse, NumbersAreFinite) {
  int options = 0;
  std::istringstream verbs_help(run_well("--help").out);
  for (std::string verb, line; std::getline(verbs_help, line);) {
    std::istringstream words(line);
    if (!line.starts_with("  ") || !(words >> verb) || verb.starts_with("-") || verb == "octosurf") continue;
    std::istringstream help(run_well(verb + " --help").out);
    while (std::getline(help, line)) {
      const auto at = line.find(" FLOAT");
      if (!line.starts_with("  -") || at > 40) continue;
      const auto named = line.find("--");  // "-h,--help", "--seconds,--time"
      const std::string option = line.substr(named, std::min(at, line.find(',', named)) - named);
      const auto x = line.find(" x ", at);
      for (const std::string number : {" nan", " inf"}) {
        std::string all = verb + " " + option;
        for (int k = x < at + 12 ? std::stoi(line.substr(x + 3)) : 1; k > 0; --k) all += number;
        wrong_use(all, {option});
      }
      ++options;
    }
  }
  EXPECT_GT(options, 30);
}

TEST_F(WrongUse, OutputThatGoesNowhereIsAFailure) {
  for (const char* arguments :
       {"info m --json", "query m --below 0 0 1", "diff m m", "explain m --at 0 0 0", "--help"}) {
    const Outcome outcome = run(arguments, R"(sh -c '"$0" "$@" >/dev/full')");
    EXPECT_EQ(outcome.code, 1) << arguments;
    EXPECT_THAT(outcome.errors, ::testing::ElementsAre(says("standard output"))) << arguments;
  }
}

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
  EXPECT_EQ(parameters.at("range_noise"), "estimated");
  EXPECT_TRUE(parameters.at("min_surface_points").is_number_integer());
  EXPECT_EQ(parameters.size(), parameter_infos().size());
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
