#include "bounds.hpp"
#include "scan_feed.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace octosurf {

namespace {

constexpr const char* rare_options =
    "Rarely needed: of bags --pose-frame FRAME whose poses --pose-topic gives [Odometry's child frame, else "
    "the\nsensor's], or where rays of clouds in the map's frame start.\n";

void add_bag_options(CLI::App& verb, BagOptions& bag) {
  verb.option_defaults()->group("Bags");
  verb.add_option("--topic", bag.topics, "clouds or depth images; may be given several times [the only one]")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb.add_option("--pose-topic", bag.pose_topic,
                  "Odometry, Path, PoseStamped, PoseWithCovarianceStamped or TransformStamped [tf]");
  verb.add_option("--pose-frame", bag.pose_frame)->group(rare_group);
  verb.add_option("--fixed-frame", bag.fixed_frame,
                  "the map's frame in tf [map, else the root above the sensor]");
  verb.add_option_function<std::string>(
          "--stamps", [&bag](const std::string& name) { bag.recorded_stamps = name == "recorded"; },
          "header, recorded: whose time to take, if clocks of drivers differ [header]")
      ->check(CLI::IsMember({"header", "recorded"}));
}

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

/// What readings are none, and of which sensor they are.
void add_reading_options(CLI::App& verb, ScanSourceOptions& source) {
  verb.add_option(
          "--no-return", source.no_return,
          "m: range (of cameras: depth) that stands for no return, besides 0 and what is no number; may be "
          "given several times [none]")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb.add_option_function<std::vector<std::string>>(
          "--self-box", [&source](const std::vector<std::string>& words) { add_self_boxes(words, source); },
          "[FRAME] X Y Z X Y Z: two corners of a box, m, in the sensor's frame or a frame of the bag's tf; "
          "readings in it are the robot itself and are left out; may be given several times [none]")
      ->expected(6, 7)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb.add_option_function<std::string>(
          "--sensor",
          [&source](const std::string& name) {
            source.sensor = name == "camera" ? SensorKind::depth_camera : SensorKind::lidar;
          },
          "sensor of clouds: camera (--max-range 4 unless given) or lidar [lidar; camera in an "
          "_optical_frame]")
      ->check(CLI::IsMember({"camera", "lidar"}));
}

/// "auto", or three numbers.
std::optional<Eigen::Vector3d> origin_of(const std::vector<std::string>& words) {
  if (words.size() == 1 && words[0] == "auto") return {};
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  bool good = words.size() == 3;
  for (std::size_t i = 0; i < words.size() && good; ++i)
    good = CLI::detail::lexical_cast(words[i], origin[static_cast<int>(i)]);
  if (!good || !origin.allFinite())
    throw CLI::ValidationError("--origin", "expects auto, or X Y Z in metres");
  return origin;
}

}  // namespace

void add_scan_options(CLI::App& verb, ScanSourceOptions& source, ScanRange& range) {
  verb.option_defaults()->group("Scans");
  verb.add_option("--poses", source.poses, "file with a pose per scan, or a stamped trajectory")
      ->type_name("FILE");
  verb.add_option("--intrinsics", source.intrinsics, "file with K (3x3) or fx fy cx cy")->type_name("FILE");
  verb.add_option("--depth-scale", source.depth_scale,
                  "units per metre of depth images or clouds: 1000 for millimetres, 3.2808 for feet [images: "
                  "what the bag says, 5000 for TUM, else 1000; clouds: 1]");
  add_reading_options(verb, source);
  verb.add_option_function<std::vector<double>>(
          "--viewpoint",
          [&source](const std::vector<double>& at) { source.viewpoint = Eigen::Vector3d(at.data()); },
          "X Y Z: where scans without a pose were seen from, in their frame, m; 0 0 0: the sensor stood "
          "still [the origin, or above a single cloud that cannot have been seen from there]")
      ->expected(3);
  verb.add_option_function<std::string>(
          "--pose-form",
          [&source](const std::string& name) {
            const auto at = std::ranges::find(pose_form_names, name);
            source.pose_form = static_cast<PoseForm>(at - pose_form_names.begin());
          },
          "form of the poses: as-given (T_map_sensor; cameras look along z, y down), inverse, opengl "
          "(cameras look along -z, y up), opengl-inverse, w-first (quaternions qw qx qy qz), of-camera (the "
          "camera's poses for a lidar's scans, by calib.txt's Tr where it is), of-body (a body's, x forward, "
          "for a camera's), in-map (as-given, of clouds in the map's frame already) [as-given; KITTI's with "
          "calib.txt: of-camera]")
      ->check(CLI::IsMember(std::vector<std::string>(pose_form_names.begin(), pose_form_names.end())));
  verb.add_option_function<std::vector<std::string>>(
          "--origin", [&source](const std::vector<std::string>& words) { source.origin = origin_of(words); },
          "X Y Z: subtracted from all coordinates, m; stored in the map [auto: 0, or near the first scan if "
          "that is far away, as in UTM or ECEF]")
      ->expected(1, 3);
  verb.add_flag("--skip-bad", source.skip_bad, "skip scans that cannot be read or have no rigid pose");
  verb.add_option("--skip", range.skip, "leave out the first N scans")->capture_default_str();
  verb.add_option("--every", range.every, "take only every K-th scan")
      ->check(at_least(1))
      ->capture_default_str();
  verb.add_option("--first", range.first, "take at most N scans [all]")->check(at_least(1));
  add_bag_options(verb, source.bag);
  verb.option_defaults()->group("Options");
  leave_out_rare(verb);
  verb.footer(verb.get_footer() + rare_options);
}

}  // namespace octosurf
