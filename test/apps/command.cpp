#include "apps/command.hpp"

#include <chrono>
#include <fcntl.h>
#include <iomanip>
#include <sys/wait.h>
#include <unistd.h>

namespace octosurf::test {

namespace {

bool is_progress(const std::string& line) {
  return line.find(" scans") != std::string::npos && line.find('/') < line.find(" scans") &&
         line.find_first_not_of("0123456789") == line.find('/');
}

std::string pose_file(const std::string& recording, int scan) {
  std::ostringstream name;
  name << recording << "/frame-" << std::setw(6) << std::setfill('0') << scan << ".pose.txt";
  return name.str();
}

}  // namespace

Outcome CommandTest::run(const std::string& arguments, const std::string& before) const {
  const fs::path out = folder / ".out", err = folder / ".err";
  const bool of_lab = arguments.starts_with("simulate") || arguments.starts_with("evaluate");
  const std::string line = "cd '" + folder.string() + "' && " + before + " '" +
                           (of_lab ? paths::lab() : paths::command()) + "' " + arguments + " >'" +
                           out.string() + "' 2>'" + err.string() + "' </dev/null";
  const int status = std::system(line.c_str());
  Outcome outcome{
      WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(out), read_file(err), {}};
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

std::string CommandTest::ends(const std::string& arguments, int code, const Words& words) const {
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.err;
  EXPECT_EQ(outcome.errors.size(), 1u) << arguments << "\n" << outcome.err;
  if (outcome.errors.empty()) return {};
  const std::string &line = outcome.errors[0], verb = arguments.substr(0, arguments.find(' '));
  EXPECT_TRUE(line.starts_with("octosurf: ") || line.starts_with("octosurf " + verb + ": ") ||
              line.starts_with("octosurf-lab " + verb + ": "))
      << line;
  for (const std::string& word : words) EXPECT_THAT(line, HasSubstr(word)) << arguments;
  return line;
}

fs::path CommandTest::write(const std::string& name, std::string_view content) const {
  const fs::path file = folder / name;
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << content;
  return file;
}

std::string CommandTest::read(const std::string& name) const {
  EXPECT_TRUE(exists(name)) << name;
  return read_file(folder / name);
}

json CommandTest::info(const std::string& map) const {
  EXPECT_THAT(check_invariants(load_map(folder / map).map), IsEmpty());
  return json_of("info " + map + " --json");
}

bool CommandTest::same_maps(const std::string& a, const std::string& b) const {
  return digest_of(load_map(folder / a).map) == digest_of(load_map(folder / b).map) &&
         read(a + ".bt") == read(b + ".bt");
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

void CommandTest::write_depths(const std::string& name, int width, int height,
                               const std::function<double(int, int)>& depth_mm) const {
  std::string image = "P5\n" + std::to_string(width) + " " + std::to_string(height) + "\n65535\n";
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const auto depth = static_cast<int>(std::lround(depth_mm(u, v)));
      image += {static_cast<char>(depth >> 8), static_cast<char>(depth & 0xff)};
    }
  write(name, image);
}

void CommandTest::simulate_room() const {
  made_once("room", [this] { run_well("simulate room -o room --frames 16"); });
}

void CommandTest::change_poses(const std::string& recording, const Change& change) const {
  int i = 0;
  for (; exists(pose_file(recording, i)); ++i) {
    std::istringstream in(read(pose_file(recording, i)));
    Eigen::Matrix4d T;
    for (int k = 0; k < 16; ++k) in >> T(k / 4, k % 4);
    std::ostringstream out;
    out.precision(std::numeric_limits<double>::max_digits10);
    out << change(T, i) << '\n';
    write(pose_file(recording, i), out.str());
  }
  ASSERT_GT(i, 0) << recording;
}

void CommandTest::write_poses(const std::string& name, const std::vector<Eigen::Isometry3d>& poses,
                              double rate_hz) const {
  std::ostringstream lines;
  lines.precision(std::numeric_limits<double>::max_digits10);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (rate_hz > 0) lines << static_cast<double>(i) / rate_hz << ' ';
    const Eigen::Quaterniond q(poses[i].linear());
    lines << poses[i].translation().transpose() << ' ' << q.coeffs().transpose() << '\n';
  }
  write(name, lines.str());
}

void CommandTest::write_floor(const std::string& name, int images, double slid) const {
  for (int i = 0; i < images; ++i)
    write_depths(name + "/" + std::to_string(i) + ".pgm", 80, 60, [](int, int) { return 1000; });
  write_poses(name + "/poses.txt", floor_poses(images, slid));
  write(name + "/intrinsics.txt", "60 60 39.5 29.5\n");
}

void CommandTest::write_times(const std::string& recording, int scans, double rate_hz) const {
  std::string lines;
  for (int i = 0; i < scans; ++i) lines += std::to_string(i / rate_hz) + "\n";
  write(recording + "/times.txt", lines);
}

std::vector<Eigen::Isometry3d> CommandTest::floor_poses(int images, double slid) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < images; ++i)  // half a turn about x: looks down
    poses.push_back(Eigen::Translation3d(0.1 * i, 0, 1 + floor_height + slid) *
                    Eigen::Quaterniond(0, 1, 0, 0));
  return poses;
}

Running::Running(const fs::path& folder, const std::vector<std::string>& arguments,
                 const std::string& program)
    : errors_(folder / ".running") {
  std::vector<const char*> words{program.c_str()};
  for (const std::string& argument : arguments) words.push_back(argument.c_str());
  words.push_back(nullptr);
  child_ = fork();
  if (child_ < 0) throw std::runtime_error("cannot start a process");
  if (child_ > 0) return;
  const int err = ::open(errors_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int none = ::open("/dev/null", O_RDWR);
  if (err < 0 || none < 0 || ::dup2(none, 0) < 0 || ::dup2(none, 1) < 0 || ::dup2(err, 2) < 0 ||
      ::chdir(folder.c_str()) != 0)
    _exit(126);
  ::execv(words[0], const_cast<char* const*>(words.data()));
  _exit(127);
}

Running::~Running() {
  if (!runs()) return;
  send(SIGKILL);
  wait();
}

bool Running::runs() {
  if (!ended_) ended_ = ::waitpid(child_, &status_, WNOHANG) == child_;
  return !ended_;
}

bool Running::wait_until(const std::function<bool()>& holds) {
  for (;;) {
    const bool still = runs();  // asked first: what it did last counts
    if (holds()) return true;
    if (!still) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

int Running::wait() {
  if (!ended_) ::waitpid(child_, &status_, 0);
  ended_ = true;
  return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
}

std::string Running::errors() const { return read_file(errors_); }

}  // namespace octosurf::test
