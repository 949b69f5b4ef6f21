#include "io/readers/reading_rules.hpp"

#include "io/text_file.hpp"
#include "sensing/downsample.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/sensor.hpp>

namespace octosurf::io {
namespace {

/// m: values are the same to the millimetre, as formats store them.
constexpr float same_m = 1e-3F;
/// Larger values, in metres or millimetres, are a format's largest number.
constexpr float no_farther = 1e8F;
/// Least number and share of readings with a value that means no return.
constexpr std::size_t least_alike = 50;
constexpr double least_share = 0.01;
/// Share of the value: range below it with hardly any readings. Real readings thin out gradually, or lie on a
/// wall that continues towards the sensor.
constexpr float empty_below = 0.9F;
constexpr double hardly_any = 0.01;  // of the readings with the value; of a floor before a wall 3 %
/// m: inside of a lidar's housing, where rays start beside the origin.
constexpr float housing_m = 0.1F;

bool is_reading(const Eigen::Vector3f& p) { return p.allFinite() && p.cwiseAbs().maxCoeff() < no_farther; }

/// Readings at one distance.
struct Alike {
  float distance = 0;
  std::vector<Eigen::Vector3f> points;
};

/// Of every `step`th point those with the largest distance, if they are many and far from the others.
template <class Distance>
std::optional<Alike> far_alike(const std::vector<Eigen::Vector3f>& points, std::size_t step,
                               const Distance& distance_of) {
  float longest = 0;
  std::size_t readings = 0;
  for (std::size_t i = 0; i < points.size(); i += step)
    if (is_reading(points[i])) longest = std::max(longest, distance_of(points[i])), ++readings;
  Alike alike{longest, {}};
  std::size_t below = 0;
  for (std::size_t i = 0; i < points.size(); i += step) {
    const Eigen::Vector3f& p = points[i];
    if (!is_reading(p)) continue;
    const float distance = distance_of(p);
    if (longest - distance <= same_m)
      alike.points.push_back(p);
    else if (distance > empty_below * longest)
      ++below;
  }
  const auto count = static_cast<double>(alike.points.size());
  // Beside them some must have returned.
  if (alike.points.size() < least_alike || count > (1 - least_share) * static_cast<double>(readings) ||
      count < least_share * static_cast<double>(readings) || static_cast<double>(below) > hardly_any * count)
    return {};
  return alike;
}

/// Of all points. Most scans have none, which a sample shows: in it 50 readings are a quarter of a hundredth.
template <class Distance>
std::optional<Alike> far_alike(const std::vector<Eigen::Vector3f>& points, const Distance& distance_of) {
  constexpr std::size_t sample = 20000;
  const std::size_t step = points.size() / sample + 1;
  if (step > 1 && !far_alike(points, step, distance_of)) return {};
  return far_alike(points, 1, distance_of);
}

/// A ring on a floor has one range, too, but lies in a plane.
bool in_a_plane(const Alike& alike) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : alike.points) mean += p.cast<double>();
  mean /= static_cast<double>(alike.points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3f& p : alike.points) {
    const Eigen::Vector3d d = p.cast<double>() - mean;
    spread += d * d.transpose() / static_cast<double>(alike.points.size());
  }
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues()[0];
  constexpr double flat = 0.01;  // of the range: a hundredth of a right angle out of the plane
  return std::sqrt(std::max(0.0, least)) < flat * static_cast<double>(alike.distance);
}

float range_of(const Eigen::Vector3f& p) { return p.norm(); }

}  // namespace

std::optional<SensorKind> ReadingRules::kind(const Sensor& sensor) const {
  const auto found = known_.find(sensor);
  return found == known_.end() ? std::nullopt : found->second.kind;
}

void ReadingRules::choose_kind(Known& known, const Scan& scan, bool depth_image, const std::string& where) {
  const char* const camera = ": mapped up to 4 m, unless --max-range says other; --sensor lidar: no limit";
  const char* const lidar =
      ": mapped at any range, unless --max-range says other; --sensor camera: up to 4 m";
  if (depth_image) {
    known.kind = SensorKind::depth_camera;
    return;
  }
  SensorGuess guess = guess_sensor(scan.points);
  if (guess.why.empty()) return;  // a later scan tells
  if (options_.sensor) {
    guess.kind = *options_.sensor;
    guess.why = guess.kind == SensorKind::lidar ? "a lidar, as stated" : "a depth camera, as stated";
  }
  known.kind = guess.kind;
  known.axis = guess.axis;
  notes_.push_back(where + ": " + guess.why + (guess.kind == SensorKind::lidar ? lidar : camera));
}

void ReadingRules::look_for_none(Known& known, const Scan& scan, const std::string& where) {
  const auto add = [&](const Alike& alike, const char* how) {
    for (const float none : known.none)
      if (std::abs(none - alike.distance) <= same_m) return;
    known.none.push_back(alike.distance);
    notes_.push_back(where + formatted(": %zu readings of its %zu lie at %.3f m%s: taken as no return; "
                                       "--no-return names such values, 0: there are none",
                                       alike.points.size(), scan.points.size(),
                                       static_cast<double>(alike.distance), how));
  };
  if (known.kind == SensorKind::depth_camera) {
    const auto depths = far_alike(scan.points, [&](const auto& p) { return p[known.axis]; });
    if (depths && depths->distance > sensing::depth_camera_max_range) add(*depths, ", and none before");
    return;
  }
  // Nearer, a floor seen from straight above is as level.
  if (const auto ranges = far_alike(scan.points, range_of);
      ranges && ranges->distance > sensing::depth_camera_max_range && !in_a_plane(*ranges))
    add(*ranges, " in all directions, and none before");
  Alike near;
  for (const Eigen::Vector3f& p : scan.points)
    if (p.norm() < housing_m) near.points.push_back(p);
  if (near.points.size() < least_alike) return;
  near.distance = near.points.front().norm();
  if (std::ranges::all_of(near.points,
                          [&](const auto& p) { return std::abs(p.norm() - near.distance) <= same_m; }))
    add(near, ", where the rays start");
}

std::vector<std::size_t> ReadingRules::drop(Known& known, Scan& scan, bool depth_image,
                                            const std::string& where) {
  const bool camera = known.kind == SensorKind::depth_camera;
  const auto clear_m = static_cast<float>(options_.clear_no_return_m);
  std::vector<std::size_t> free;
  if (depth_image && known.none.empty() &&
      std::ranges::all_of(scan.points, [](const Eigen::Vector3f& p) { return p.z() < no_farther; }))
    return free;  // nothing to drop, as in most
  std::vector<bool> without(scan.points.size());
  std::size_t huge = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    Eigen::Vector3f& p = scan.points[i];
    if (!p.allFinite()) continue;
    bool none = !is_reading(p);
    huge += none && !depth_image ? 1 : 0;
    if (depth_image && none) without[i] = true;
    for (const float value : known.none)
      if ((!depth_image && std::abs(range_of(p) - value) <= same_m) ||
          (camera && std::abs(p[known.axis] - value) <= same_m))
        none = without[i] = true;
    if (!none) continue;
    if (clear_m > 0 && without[i])
      p *= clear_m / range_of(p);
    else
      p.setConstant(std::numeric_limits<float>::quiet_NaN());
  }
  // Pixels have their margin; of clouds, rays beside a reading may graze its surface.
  if (clear_m > 0)
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      if (!without[i]) continue;
      if (depth_image || ((i == 0 || without[i - 1]) && (i + 1 == scan.points.size() || without[i + 1])))
        free.push_back(i);
      else
        scan.points[i].setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  if (huge > 0 && !std::exchange(known.huge, true))
    notes_.push_back(
        where + formatted(": %zu readings of its %zu are farther than the earth is wide: taken as no return",
                          huge, scan.points.size()));
  return free;
}

std::vector<std::size_t> ReadingRules::apply(Scan& scan, const Sensor& sensor, bool depth_image,
                                             const std::string& where) {
  if (depth_image && options_.sensor == SensorKind::lidar)
    throw Error(Error::Kind::usage, "--sensor lidar", where + " has depth images, which are a camera's",
                "--max-range lifts their limit of 4 m");
  Known& known = known_[sensor];
  if (!options_.no_return.empty()) known.none.assign(options_.no_return.begin(), options_.no_return.end());
  const auto clean = [&](Scan& given) {
    if (options_.no_return.empty()) look_for_none(known, given, where);
    return drop(known, given, depth_image, where);
  };
  if (!known.kind) {
    if (!depth_image) {  // or half of the rays would seem to lie behind others
      Scan cleaned = scan;
      move_to_free_rays(cleaned, clean(cleaned));
      choose_kind(known, cleaned, depth_image, where);
    } else {
      choose_kind(known, scan, depth_image, where);
    }
  }
  std::vector<std::size_t> free = clean(scan);
  scan.sensor = known.kind.value_or(options_.sensor.value_or(scan.sensor));
  return free;
}

void move_to_free_rays(Scan& scan, const std::vector<std::size_t>& places) {
  if (places.empty()) return;
  std::size_t kept = places.front(), next = 0;
  for (std::size_t i = kept; i < scan.points.size(); ++i) {
    if (next < places.size() && places[next] == i) {
      scan.free_rays.push_back(scan.points[i]);
      ++next;
      continue;
    }
    scan.points[kept] = scan.points[i];
    if (!scan.times_s.empty()) scan.times_s[kept] = scan.times_s[i];
    if (!scan.origins.empty()) scan.origins[kept] = scan.origins[i];
    ++kept;
  }
  scan.points.resize(kept);
  if (!scan.times_s.empty()) scan.times_s.resize(kept);
  if (!scan.origins.empty()) scan.origins.resize(kept);
}

std::size_t erase_own(Scan& scan, std::span<const SelfBox> boxes,
                      const std::function<Eigen::Isometry3d(const std::string& frame)>& sensor_in) {
  std::size_t own = 0;
  for (const SelfBox& self : boxes) {
    const Eigen::Isometry3f T =
        (self.frame ? sensor_in(*self.frame) : Eigen::Isometry3d::Identity()).cast<float>();
    const Eigen::AlignedBox3f box = self.box.cast<float>();
    for (Eigen::Vector3f& point : scan.points) {
      if (!box.contains(T * point)) continue;  // nor does it contain NaN
      point.setConstant(std::numeric_limits<float>::quiet_NaN());
      ++own;
    }
  }
  return own;
}

}  // namespace octosurf::io
