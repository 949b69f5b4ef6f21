#pragma once

#include "io/files.hpp"
#include "support/invariants.hpp"
#include "support/paths.hpp"

#include <csignal>
#include <nlohmann/json.hpp>
#include <sys/types.h>

#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::test {

using nlohmann::json;

/// What a run of the program left behind.
struct Outcome {
  int code = -1;
  std::string out, err;
  /// Of stderr, without progress and the note of builds that are not optimised.
  std::vector<std::string> errors;
};

/// Runs the built `octosurf` in a fresh folder, which is removed afterwards.
class CommandTest : public FolderTest {
 protected:
  /// In the fresh folder, through the shell; `before` stands in front of the program, e.g. "timeout 1".
  Outcome run(const std::string& arguments, const std::string& before = {}) const;
  /// Fails the test unless the exit code is 0.
  Outcome run_well(const std::string& arguments) const;
  json json_of(const std::string& arguments) const { return json::parse(run_well(arguments).out); }
  /// Each fails the test unless it ends with 1, or 2, and one line on stderr, which has all these words in
  /// it.
  using Words = std::vector<std::string>;
  void fails(const std::string& arguments, const Words& words) const { ends(arguments, 1, words); }
  void wrong_use(const std::string& arguments, const Words& words) const { ends(arguments, 2, words); }
  /// The same; returns the line.
  std::string ends(const std::string& arguments, int code, const Words& words) const;

  fs::path write(const std::string& name, std::string_view content) const;
  std::string read(const std::string& name) const;
  bool exists(const std::string& name) const { return fs::exists(folder / name); }
  json read_json(const std::string& name) const { return json::parse(read(name)); }
  json info(const std::string& map) const;  ///< of a map, whose invariants hold
  /// To the byte.
  bool same_maps(const std::string& a, const std::string& b) const;

  /// What `make` leaves in the folder: made once in a process, copied for every later test. A name with the
  /// seed in it, where that is drawn from.
  void made_once(const std::string& name, const std::function<void()>& make) const;

  /// An ASCII PCD of rows "x y z\n".
  fs::path write_pcd(const std::string& name, const std::string& rows,
                     const std::string& viewpoint = "0 0 0 1 0 0 0") const;
  /// A binary PGM of 16 bits.
  void write_depths(const std::string& name, int width, int height,
                    const std::function<double(int, int)>& depth_mm) const;
  /// "room": a simulated recording of sixteen depth images.
  void simulate_room() const;
  /// Of a recording with a file of 4×4 for each scan: what `change` makes of each and its number.
  using Change = std::function<Eigen::Matrix4d(const Eigen::Matrix4d&, int)>;
  void change_poses(const std::string& recording, const Change& change) const;
  /// A line tx ty tz qx qy qz qw each; before it a time, where there is a rate.
  void write_poses(const std::string& name, const std::vector<Eigen::Isometry3d>& poses,
                   double rate_hz = 0) const;
  /// `images` depth images of a floor at z = floor_height, seen by a camera that looks down from a
  /// metre above and moves 0.1 m along x from one to the next: each sees
  /// 79/60 m × 59/60 m. PGM in millimetres, with poses.txt and intrinsics.txt.
  /// `slid`: m, by which the poses are too high.
  void write_floor(const std::string& name = "floor", int images = 6, double slid = 0) const;
  /// times.txt beside the scans.
  void write_times(const std::string& recording, int scans, double rate_hz) const;
  static std::vector<Eigen::Isometry3d> floor_poses(int images = 6, double slid = 0);
  static constexpr int floor_points = 80 * 60;  ///< per image
  static constexpr double floor_height = 0.013;
};

/// With the scans "floor" in the folder and "m", their map.
class FloorTest : public CommandTest {
 protected:
  FloorTest() {
    made_once("floor", [this] {
      write_floor();
      run_well("map floor -o m");
    });
  }
  /// What `query`, or another verb, answers about "m".
  json ask(const std::string& what, const std::string& verb = "query") const {
    return json_of(verb + " m --json " + what);
  }
};

/// The built `octosurf`, or another program, at work beside the test, in `folder`; killed if it is still
/// there in the end.
class Running {
 public:
  Running(const fs::path& folder, const std::vector<std::string>& arguments,
          const std::string& program = paths::command());
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running();

  void send(int signal) const { ::kill(child_, signal); }
  /// False if it has ended.
  bool runs();
  /// Until `holds` or it has ended; asks every tenth of a millisecond. Returns whether it holds.
  bool wait_until(const std::function<bool()>& holds);
  /// Its exit code, or 128 + the signal that ended it.
  int wait();
  std::string errors() const;  ///< its stderr so far

 private:
  fs::path errors_;
  pid_t child_ = 0;
  int status_ = 0;
  bool ended_ = false;
};

}  // namespace octosurf::test
