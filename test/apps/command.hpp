#pragma once

#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf::test {

/// What a run of the program left behind.
struct Outcome {
  int code = -1;
  std::string out, err;
  /// Of stderr, without progress and the note of builds that are not optimised.
  std::vector<std::string> errors;
};

/// Runs the built `octosurf` in a fresh folder, which is removed afterwards.
class CommandTest : public ::testing::Test {
 protected:
  CommandTest();
  ~CommandTest() override;

  /// In the fresh folder, through the shell; `before` stands in front of the program, e.g. "timeout 1".
  Outcome run(const std::string& arguments, const std::string& before = {}) const;
  /// Fails the test unless the exit code is 0.
  Outcome run_well(const std::string& arguments) const;
  nlohmann::json json_of(const std::string& arguments) const {
    return nlohmann::json::parse(run_well(arguments).out);
  }
  /// Fails the test unless it ends with this code and one line on stderr; returns the line.
  std::string error_of(const std::string& arguments, int code) const;

  std::filesystem::path write(const std::string& name, std::string_view content) const;
  std::string read(const std::string& name) const;
  bool exists(const std::string& name) const { return std::filesystem::exists(folder / name); }
  nlohmann::json read_json(const std::string& name) const;
  nlohmann::json info(const std::string& map) const;  ///< of a map, whose invariants hold

  /// What `make` leaves in the folder: made once in a process, copied for every later test. A name with the
  /// seed in it, where that is drawn from.
  void made_once(const std::string& name, const std::function<void()>& make) const;

  /// An ASCII PCD of rows "x y z\n".
  std::filesystem::path write_pcd(const std::string& name, const std::string& rows,
                                  const std::string& viewpoint = "0 0 0 1 0 0 0") const;
  /// "room": a simulated recording of sixteen depth images.
  void simulate_room() const;
  /// Another one, its poses as quaternions in poses.txt, which is how bags have them.
  void simulate_for_bag(const std::string& name, const std::string& options) const;
  /// `images` depth images of a floor at z = floor_height, seen by a camera that looks down from a
  /// metre above and moves 0.1 m along x from one to the next: each sees
  /// 79/60 m × 59/60 m. PGM in millimetres, with poses.txt (tx ty tz qx qy qz qw) and intrinsics.txt.
  /// `slid`: m, by which the poses are too high.
  void write_floor(const std::string& name = "floor", int images = 6, double slid = 0) const;
  static constexpr int floor_points = 80 * 60;  ///< per image
  static constexpr double floor_height = 0.013;

  std::filesystem::path folder;
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
  nlohmann::json ask(const std::string& what, const std::string& verb = "query") const {
    return json_of(verb + " m --json " + what);
  }
};

}  // namespace octosurf::test
