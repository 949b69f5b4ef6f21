#include "reading_options.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace octosurf {

namespace {

/// Of each: six numbers, the first of all boxes' words may be a frame.
void add_self_boxes(const std::vector<std::string>& words, ScanSourceOptions& source) {
  source.self_boxes.clear();
  for (std::size_t i = 0; i < words.size();) {
    SelfBox self;
    double number = 0;
    if (!CLI::detail::lexical_cast(words[i], number)) self.frame = words[i++];
    std::array<double, 6> sides{};
    bool good = i + sides.size() <= words.size();
    for (std::size_t k = 0; k < sides.size() && good; ++k)
      good = CLI::detail::lexical_cast(words[i + k], sides[k]) && std::isfinite(sides[k]);
    if (!good) throw CLI::ValidationError("--self-box", "expects [FRAME] X Y Z X Y Z, two corners in metres");
    i += sides.size();
    const Eigen::Map<const Eigen::Vector3d> a(sides.data()), b(&sides[3]);
    self.box = Eigen::AlignedBox3d(a.cwiseMin(b).eval(), a.cwiseMax(b).eval());
    source.self_boxes.push_back(self);
  }
}

}  // namespace

void add_reading_options(CLI::App& verb, ScanSourceOptions& source) {
  const char* const group = "Scans";
  verb.add_option(
          "--no-return", source.no_return,
          "m: range (of cameras: depth) that stands for no return, besides 0 and what is no number; may be "
          "given several times [none]")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(group);
  verb.add_option_function<std::vector<std::string>>(
          "--self-box", [&source](const std::vector<std::string>& words) { add_self_boxes(words, source); },
          "[FRAME] X Y Z X Y Z: two corners of a box, m, in the sensor's frame or a frame of the bag's tf; "
          "readings in it are the robot itself and are left out; may be given several times [none]")
      ->expected(6, 7)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(group);
  verb.add_option_function<std::string>(
          "--sensor",
          [&source](const std::string& name) {
            source.sensor = name == "camera" ? SensorKind::depth_camera : SensorKind::lidar;
          },
          "sensor of clouds: camera (--max-range 4 unless given) or lidar [lidar; camera in an "
          "_optical_frame]")
      ->check(CLI::IsMember({"camera", "lidar"}))
      ->group(group);
}

}  // namespace octosurf
