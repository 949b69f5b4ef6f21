#include "scan_options.hpp"

#include "bounds.hpp"
#include "reading_options.hpp"

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

namespace octosurf {

namespace {

constexpr const char* rare_options =
    "Rarely needed: --rate HZ of scans without time stamps [30, lidar 10]; --deskew off: leave the sensor's "
    "motion\nwithin a scan [auto: undo it by the points' times]; of bags --pose-frame FRAME whose poses "
    "--pose-topic gives\n[Odometry's child frame, else the sensor's].\n";

void add_bag_options(CLI::App& verb, BagOptions& bag) {
  const char* const group = "Bags";
  verb.add_option("--topic", bag.topics, "clouds or depth images; may be given several times [the only one]")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(group);
  verb.add_option("--pose-topic", bag.pose_topic,
                  "Odometry, PoseStamped, PoseWithCovarianceStamped or TransformStamped [tf]")
      ->group(group);
  verb.add_option("--pose-frame", bag.pose_frame)->group(rare_group);
  verb.add_option("--fixed-frame", bag.fixed_frame,
                  "the map's frame in tf [map, else the root above the sensor]")
      ->group(group);
  verb.add_option_function<std::string>(
          "--stamps", [&bag](const std::string& name) { bag.recorded_stamps = name == "recorded"; },
          "header, recorded: whose time to take, if clocks of drivers differ [header]")
      ->check(CLI::IsMember({"header", "recorded"}))
      ->group(group);
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

/// "K/N".
void set_part(const std::string& text, ScanRange& range) {
  const std::size_t slash = text.find('/');
  constexpr std::size_t most = 1000000;  // parts, so that scans times parts stay below 2⁶⁴
  std::size_t part = 0, parts = 0;
  const auto digits = [](const std::string& word) {
    return !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
  };
  const bool good = slash != std::string::npos && digits(text.substr(0, slash)) &&
                    digits(text.substr(slash + 1)) &&
                    CLI::detail::lexical_cast(text.substr(0, slash), part) &&
                    CLI::detail::lexical_cast(text.substr(slash + 1), parts);
  if (!good || part < 1 || part > parts || parts > most)
    throw CLI::ValidationError("--subset", text + " is no K/N with K from 1 to N, as in 3/16");
  range.part = part;
  range.parts = parts;
}

}  // namespace

void add_scan_options(CLI::App& verb, ScanSourceOptions& source, ScanRange& range) {
  const char* const group = "Scans";
  verb.add_option("--poses", source.poses, "file with a pose per scan, or a stamped trajectory")
      ->type_name("FILE")
      ->group(group);
  verb.add_option("--intrinsics", source.intrinsics, "file with K (3x3) or fx fy cx cy")
      ->type_name("FILE")
      ->group(group);
  verb.add_option("--depth-scale", source.depth_scale,
                  "units of a depth image per metre [5000 for TUM, else 1000]")
      ->group(group);
  verb.add_option("--cloud-scale", source.cloud_scale,
                  "units of a cloud per metre: 1000 for millimetres, 3.2808 for feet [1]")
      ->group(group);
  add_reading_options(verb, source);
  verb.add_option("--rate", source.rate_hz)->group(rare_group);
  verb.add_option("--max-pose-gap", source.max_pose_gap_s,
                  "longest gap between poses to interpolate over, s [0.1, bags 0.25]")
      ->group(group);
  verb.add_option_function<std::vector<std::string>>(
          "--origin", [&source](const std::vector<std::string>& words) { source.origin = origin_of(words); },
          "X Y Z: subtracted from all coordinates, m; stored in the map [auto: 0, or near the first scan if "
          "that is far away, as in UTM or ECEF]")
      ->expected(1, 3)
      ->group(group);
  verb.add_option_function<std::string>("--deskew",
                                        [&source](const std::string& name) { source.deskew = name != "off"; })
      ->check(CLI::IsMember({"auto", "off"}))
      ->group(rare_group);
  verb.add_flag("--skip-bad", source.skip_bad, "skip scans that cannot be read or have no rigid pose")
      ->group(group);
  verb.add_option("--skip", range.skip, "leave out the first N scans")->capture_default_str()->group(group);
  verb.add_option("--every", range.every, "take only every K-th scan")
      ->check(at_least(1))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--first", range.first, "take at most N scans [all]")->check(at_least(1))->group(group);
  verb.add_option_function<std::string>(
          "--subset", [&range](const std::string& text) { set_part(text, range); },
          "K/N: cut the scans that are left into N contiguous parts and take the K-th [1/1]")
      ->group(group);
  add_bag_options(verb, source.bag);
  leave_out_rare(verb);
  verb.footer(verb.get_footer() + rare_options);
}

}  // namespace octosurf
