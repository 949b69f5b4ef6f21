#include "run_warnings.hpp"

#include "geometry/degrees.hpp"
#include "io/text_file.hpp"
#include "sensing/downsample.hpp"
#include "surfaces/double_layers.hpp"
#include "surfaces/map_state.hpp"
#include "up_option.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

/// Clouds without poses are from a stationary sensor, or their poses are in a file that was not given; or
/// they are in another frame than the sensor's.
void warn_of_missing_poses(const RunStatistics& statistics) {
  const auto scans = static_cast<std::size_t>(statistics.scans());
  if (scans == 0 || statistics.scans_at_origin() < scans) return;
  if (scans == 1)
    std::fprintf(
        stderr,
        "warning: the scan is mapped as seen from the map's origin, as it came without a pose; if the "
        "sensor was elsewhere, --viewpoint X Y Z or --poses FILE says where\n");
  else
    std::fprintf(
        stderr,
        "warning: all %zu scans are mapped from the map's origin, as they came without poses; if the sensor "
        "has moved, --poses FILE gives them\n",
        scans);
}

/// A sensor's usual limit is a guess where it cuts much.
void warn_of_limit(const RunStatistics& statistics, const Map& map) {
  const ScanReport& totals = statistics.totals();
  const std::size_t readings = totals.points_raw - totals.points_not_finite;
  if (map.parameters().occupancy.max_range || 3 * totals.points_beyond_range <= readings) return;
  std::fprintf(
      stderr,
      "warning: %.0f %% of the readings were only taken as free space, as they lie beyond 4 m, a depth "
      "camera's usual range: --max-range maps farther ones, and of clouds --sensor lidar all\n",
      100 * static_cast<double>(totals.points_beyond_range) / static_cast<double>(readings));
}

void warn_of_closures(const RunStatistics& statistics) {
  const std::vector<LoopClosure>& closures = statistics.closures();
  if (closures.empty()) return;
  const LoopClosure& worst = *std::max_element(
      closures.begin(), closures.end(),
      [](const LoopClosure& a, const LoopClosure& b) { return a.farthest_m < b.farthest_m; });
  const std::string where =
      worst.first == worst.last ? "at " + worst.first : "from " + worst.first + " to " + worst.last;
  std::fprintf(
      stderr,
      "warning: %s where the poses do not meet what was mapped before, the farthest %s: %.1f cm; "
      "the way between is bent by as much, and remap straightens it with poses that close the loop\n",
      io::count_of(closures.size(), "place").c_str(), where.c_str(), 100 * worst.farthest_m);
}

void warn_of_double_layers(const Map& map) {
  const std::vector<surfaces::DoubleLayer> layers = surfaces::double_layers(surfaces::state_of(map).surfaces);
  if (layers.empty()) return;
  const surfaces::DoubleLayer& worst = *std::ranges::max_element(layers, {}, &surfaces::DoubleLayer::inliers);
  std::fprintf(stderr, "warning: %s of two surfaces on one face, e.g. %u and %u, %.1f cm apart\n",
               io::count_of(layers.size(), "pair").c_str(), worst.smaller, worst.larger,
               100 * worst.distance_m);
}

/// In or beside an input, by its name; empty if there is none.
std::string pose_like_file(const std::vector<std::string>& inputs) {
  namespace fs = std::filesystem;
  for (const std::string& input : inputs)
    for (const fs::path& folder : {fs::path(input), fs::absolute(input).parent_path()}) {
      std::error_code ignored;
      std::vector<std::string> found;
      for (const auto& entry : fs::directory_iterator(folder, ignored)) {
        std::string name = entry.path().filename().string();
        std::transform(name.begin(), name.end(), name.begin(),
                       [](unsigned char c) { return std::tolower(c); });
        const std::string ending = entry.path().extension().string();
        const bool text = ending == ".txt" || ending == ".csv" || ending == ".tum" || ending == ".g2o";
        if (name.ends_with(".pose.txt")) continue;  // of one scan each, which are read without being named
        for (const char* const part : {"pose", "traj", "groundtruth", "odom"})
          if (text && name.find(part) != std::string::npos) found.push_back(entry.path().string());
      }
      if (!found.empty()) return *std::min_element(found.begin(), found.end());
    }
  return {};
}

/// m, the range of 19 of 20 readings; 0: no readings.
double usual_range(const Scan& scan) {
  std::vector<float> ranges;
  for (const Eigen::Vector3f& point : scan.points)
    if (const float range = point.norm(); std::isfinite(range)) ranges.push_back(range);
  if (ranges.empty()) return 0;
  const auto at = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() * 19 / 20);
  std::nth_element(ranges.begin(), at, ranges.end());
  return static_cast<double>(*at);
}

}  // namespace

void require_metres(const Scan& scan, const Parameters& parameters) {
  // No robot's sensor reaches so far, and rays of kilometres take hours and all memory.
  constexpr double farthest = 300;  // m
  const double range = usual_range(scan);
  if (scan.sensor != SensorKind::lidar || parameters.occupancy.max_range || range <= farthest) return;
  throw Error(Error::Kind::data, scan.name,
              "its readings reach " + std::to_string(static_cast<long>(range)) + " m, as if not in metres",
              "--cloud-scale 1000 for millimetres, 100 for centimetres; 1, if they are metres");
}

void require_poses(const Scan& first, const Scan* second, const std::vector<std::string>& inputs) {
  const auto without = [](const Scan& scan) {
    return scan.T_map_sensor.matrix() == Eigen::Isometry3d::Identity().matrix();
  };
  if (!without(first)) return;
  const std::string file = pose_like_file(inputs);
  if (file.empty()) return;
  if (second != nullptr && without(*second))
    throw Error(Error::Kind::usage, first.name,
                "has no pose, nor has the next scan, and " + file + " lies beside them",
                "--poses " + file + ", or --viewpoint X Y Z, 0 0 0 for a sensor that stood still");
  std::fprintf(stderr, "warning: %s has no pose, or is at the origin, and %s lies beside it: --poses %s\n",
               first.name.c_str(), file.c_str(), file.c_str());
}

bool warn_of_units(const Scan& scan, const Parameters& parameters) {
  constexpr double voxels_near = 5;  // no sensor measures so near with such voxels
  const double range = usual_range(scan);
  if (!(range > 0 && range < voxels_near * parameters.occupancy.resolution)) return false;
  std::fprintf(stderr,
               "warning: 19 of 20 readings of %s lie within %.2g m of the sensor: check the units, "
               "--depth-scale, --cloud-scale\n",
               scan.name.c_str(), range);
  return true;
}

std::string spacing_warning(const Scan& scan, const Parameters& parameters) {
  std::vector<Eigen::Vector3f> points;
  const OccupancyParameters& occupancy = parameters.occupancy;
  const double max_range = occupancy.max_range.value_or(sensing::default_max_range(scan.sensor));
  for (const Eigen::Vector3f& point : scan.points)
    if (const double range = point.norm(); range > occupancy.min_range && range <= max_range)
      points.push_back(point);
  constexpr std::size_t least = 100, sample = 200;  // readings: a median to within a tenth
  if (points.size() < least) return {};
  std::vector<float> nearest;
  for (std::size_t i = 0; i < points.size(); i += 1 + points.size() / sample) {
    float distance = std::numeric_limits<float>::max();
    for (const Eigen::Vector3f& other : points)
      if (const float d = (other - points[i]).squaredNorm(); d > 0) distance = std::min(distance, d);
    nearest.push_back(std::sqrt(distance));
  }
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::nth_element(nearest.begin(), middle, nearest.end());
  // An outline bridges what is at most max_hole_size across, as is the diagonal of a square of readings.
  const double spacing = *middle, across = std::numbers::sqrt2 * spacing, hole = parameters.max_hole_size();
  if (across <= hole) return {};
  constexpr double scatter = 1.25;  // the nearest of four neighbours of a square is as much nearer
  const double wide_enough = std::min(1.0, scatter * across / hole * occupancy.resolution);
  std::array<char, 320> text{};
  std::snprintf(
      text.data(), text.size(),
      ": readings lie %.2g m apart, too far for surfaces at %g m: --resolution %g or more finds them",
      spacing, occupancy.resolution, std::ceil(100 * wide_enough) / 100);
  return scan.name + text.data();
}

namespace {

/// How scans agree far better than as given, and what helps.
std::pair<std::string, std::string> texts_of(const alignment::RecordingCheck::Finding& better) {
  using alignment::Meaning;
  std::array<char, 160> what{};
  const auto print = [&](const char* format, double value) {
    std::snprintf(what.data(), what.size(), format, value);
    return std::string(what.data());
  };
  const double value = better.value;
  const auto turned = [&](const char* axis) {
    return std::pair(print("with the sensor turned by %.1f degrees about its ", deg_per_rad * value) + axis,
                     std::string("correct the sensor's mount (extrinsic calibration)"));
  };
  switch (better.meaning) {
    case Meaning::mirrored_x:
      return {"with their x axis reversed", "mirror the images, or give right-handed coordinates"};
    case Meaning::mirrored_y:
      return {"with their y axis reversed", "turn the images, or give right-handed coordinates"};
    case Meaning::late:
      return {print("at the poses of %+.2f s after their stamps", value),
              print("add %.2f s to the scans' stamps, or take it from the poses'", value)};
    case Meaning::scale:
      return {print("if they are taken as %.2f times as long", 1 / value),
              "--depth-scale of depth images, --cloud-scale of clouds"};
    case Meaning::focal:
      return {print("with %.2f times the focal length", 1 / value), "--intrinsics FILE of this camera"};
    case Meaning::turned_x:
      return turned("x axis");
    case Meaning::turned_y:
      return turned("y axis");
    case Meaning::turned_z:
      return turned("z axis");
    default:
      return {std::string("at poses taken as ") +
                  alignment::meaning_names.at(static_cast<std::size_t>(better.meaning)),
              "--pose-form"};
  }
}

std::string dip_text(const alignment::RunAgreement& agreement) {
  const auto found = agreement.contradiction();
  if (!found) return {};
  std::array<char, 240> text{};
  if (found->moved == found->scans)
    std::snprintf(
        text.data(), text.size(),
        "the poses jump at scan %zu (%.2f s): %zu scans were far off, and moved onto the map or left out",
        found->first + 1, found->stamp_s, found->scans);
  else
    std::snprintf(
        text.data(), text.size(),
        "%zu of %zu scans contradict those before them, from scan %zu (%.2f s) on: %.0f %% of their readings "
        "agree with the map, in most scans %.1f %%",
        found->scans, agreement.scans(), found->first + 1, found->stamp_s, 100 * found->share,
        100 * agreement.median());
  return text.data();
}

std::string better_text(const RunStatistics& statistics) {
  const auto& better = statistics.better_meaning();
  if (!better) return {};
  std::array<char, 120> shares{};
  std::snprintf(shares.data(), shares.size(),
                " (%.0f %% of a scan's readings meet earlier ones, as given %.0f %%)", 100 * better->share,
                100 * better->as_given);
  return "the readings fit one another far better " + texts_of(*better).first + shares.data();
}

void warn_of_contradiction(const RunStatistics& statistics) {
  const std::string dip = dip_text(statistics.agreement()), better = better_text(statistics);
  if (!dip.empty()) std::fprintf(stderr, "warning: %s\n", dip.c_str());
  if (!better.empty()) {
    std::fprintf(stderr, "%s%s\n  %s\n", dip.empty() ? "warning: " : "  ", better.c_str(),
                 texts_of(*statistics.better_meaning()).second.c_str());
    return;
  }
  const auto found = statistics.agreement().contradiction();
  if (!found) return;
  if (found->alternates)
    std::fprintf(
        stderr,
        "  scans that agree and scans that do not take turns: two tracks, two robots or two passes of "
        "one clock\n  map one of them: --pose-topic, --skip and --first choose\n");
  else if (found->jump_m > 0 || found->jump_rad > 0)
    std::fprintf(
        stderr,
        "  poses jump there by %.2f m and %.1f degrees: a restart of odometry, or a correction\n"
        "  map up to there (--first %zu), the rest with poses of one frame (--fixed-frame, --poses)\n",
        found->jump_m, deg_per_rad * found->jump_rad, found->first);
  else
    std::fprintf(
        stderr,
        "  no step of the poses stands out, nor would another clock, unit or mount mend it: what was there "
        "has changed, or poses drift\n  --align off maps such scans, --strict writes no such map\n");
}

}  // namespace

std::string contradiction_text(const RunStatistics& statistics) {
  const std::string dip = dip_text(statistics.agreement());
  return dip.empty() ? better_text(statistics) : dip;
}

void print_warnings(const RunStatistics& statistics, const Map& map, bool viewpoint_given) {
  std::fflush(stdout);  // so that they follow the summary
  if (!viewpoint_given) warn_of_missing_poses(statistics);
  warn_of_limit(statistics, map);
  warn_of_up(map, "");
  warn_of_contradiction(statistics);
  warn_of_closures(statistics);
  warn_of_double_layers(map);
}

}  // namespace octosurf
