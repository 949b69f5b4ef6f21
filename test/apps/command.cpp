#include "apps/command.hpp"

#include "support/invariants.hpp"
#include "support/paths.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <gmock/gmock.h>
#include <iomanip>
#include <limits>
#include <map>
#include <sstream>
#include <sys/wait.h>

namespace octosurf::test {

namespace fs = std::filesystem;

namespace {

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

bool is_progress(const std::string& line) {
  return line.find(" scans") != std::string::npos && line.find('/') < line.find(" scans") &&
         line.find_first_not_of("0123456789") == line.find('/');
}

}  // namespace

CommandTest::CommandTest() {
  std::string name = (fs::temp_directory_path() / "octosurf-test-XXXXXX").string();
  folder = mkdtemp(name.data());
}

CommandTest::~CommandTest() {
  std::error_code ignored;
  fs::remove_all(folder, ignored);
}

Outcome CommandTest::run(const std::string& arguments, const std::string& before) const {
  const fs::path out = folder / ".out", err = folder / ".err";
  const bool of_lab = arguments.starts_with("simulate") || arguments.starts_with("evaluate");
  const std::string line = "cd '" + folder.string() + "' && " + before + " '" +
                           (of_lab ? paths::lab() : paths::command()) + "' " + arguments + " >'" +
                           out.string() + "' 2>'" + err.string() + "' </dev/null";
  const int status = std::system(line.c_str());
  Outcome outcome{
      WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), content_of(out), content_of(err), {}};
  std::istringstream lines(outcome.err);
  for (std::string text; std::getline(lines, text);)
    if (!is_progress(text) && text.rfind("octosurf: note:", 0) != 0) outcome.errors.push_back(text);
  return outcome;
}

Outcome CommandTest::run_well(const std::string& arguments) const {
  Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.code, 0) << arguments << "\n" << outcome.err;
  return outcome;
}

std::string CommandTest::error_of(const std::string& arguments, int code) const {
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.err;
  EXPECT_EQ(outcome.errors.size(), 1u) << arguments << "\n" << outcome.err;
  if (outcome.errors.empty()) return {};
  const std::string verb = arguments.substr(0, arguments.find(' '));
  EXPECT_TRUE(outcome.errors[0].starts_with("octosurf: ") ||
              outcome.errors[0].starts_with("octosurf " + verb + ": ") ||
              outcome.errors[0].starts_with("octosurf-lab " + verb + ": "))
      << outcome.errors[0];
  return outcome.errors[0];
}

fs::path CommandTest::write(const std::string& name, std::string_view content) const {
  const fs::path file = folder / name;
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << content;
  return file;
}

std::string CommandTest::read(const std::string& name) const {
  EXPECT_TRUE(exists(name)) << name;
  return content_of(folder / name);
}

nlohmann::json CommandTest::read_json(const std::string& name) const {
  return nlohmann::json::parse(read(name));
}

nlohmann::json CommandTest::info(const std::string& map) const {
  EXPECT_THAT(check_invariants(load_map(folder / map).map), ::testing::IsEmpty());
  return json_of("info " + map + " --json");
}

void CommandTest::made_once(const std::string& name, const std::function<void()>& make) const {
  struct Kept {
    fs::path folder;
    ~Kept() {
      std::error_code ignored;
      fs::remove_all(folder, ignored);
    }
  };
  static std::map<std::string, Kept> all;
  Kept& kept = all[name];
  if (!kept.folder.empty())
    return fs::copy(kept.folder, folder, fs::copy_options::recursive | fs::copy_options::skip_existing);
  make();
  kept.folder = folder.string() + "-" + name;
  fs::copy(folder, kept.folder, fs::copy_options::recursive);
}

fs::path CommandTest::write_pcd(const std::string& name, const std::string& rows,
                                const std::string& viewpoint) const {
  const std::string points = std::to_string(std::count(rows.begin(), rows.end(), '\n'));
  return write(name, "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + points +
                         "\nHEIGHT 1\nVIEWPOINT " + viewpoint + "\nPOINTS " + points + "\nDATA ascii\n" +
                         rows);
}

void CommandTest::simulate_room() const {
  made_once("room", [this] { run_well("simulate room -o room --frames 16"); });
}

void CommandTest::simulate_for_bag(const std::string& name, const std::string& options) const {
  run_well("simulate room -o " + name + " " + options);
  if (exists(name + "/poses.txt")) return;
  std::ostringstream poses;
  poses.precision(std::numeric_limits<double>::max_digits10);
  for (int frame = 0;; ++frame) {
    std::ostringstream pose;
    pose << name << "/frame-" << std::setw(6) << std::setfill('0') << frame << ".pose.txt";
    if (!exists(pose.str())) break;
    std::istringstream in(read(pose.str()));
    Eigen::Matrix4d T;
    for (int i = 0; i < 16; ++i) in >> T(i / 4, i % 4);
    const Eigen::Quaterniond q(Eigen::Matrix3d(T.topLeftCorner<3, 3>()));
    poses << T(0, 3) << ' ' << T(1, 3) << ' ' << T(2, 3) << ' ' << q.x() << ' ' << q.y() << ' ' << q.z()
          << ' ' << q.w() << '\n';
    fs::remove(folder / pose.str());
  }
  write(name + "/poses.txt", poses.str());
}

void CommandTest::write_floor(const std::string& name, int images, double slid) const {
  constexpr int depth_mm = 1000;
  std::string image = "P5\n80 60\n65535\n", poses;
  for (int i = 0; i < floor_points; ++i) image += {char{depth_mm >> 8}, static_cast<char>(depth_mm & 0xff)};
  for (int i = 0; i < images; ++i) {
    write(name + "/" + std::to_string(i) + ".pgm", image);
    std::ostringstream pose;
    pose << 0.1 * i << " 0 " << 1 + floor_height + slid << " 1 0 0 0\n";  // half a turn about x: looks down
    poses += pose.str();
  }
  write(name + "/poses.txt", poses);
  write(name + "/intrinsics.txt", "60 60 39.5 29.5\n");
}

}  // namespace octosurf::test
