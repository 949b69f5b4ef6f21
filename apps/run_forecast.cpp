#include "run_forecast.hpp"

#include "geometry/voxel_grid.hpp"
#include "occupancy/ray_tracer.hpp"
#include "sensing/downsample.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <numbers>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

constexpr double brick_edge = 4;  // voxels: the octree's bricks are cubes of 4³
/// Bytes of a brick while a scan is inserted: 280 in the octree, the rest for nodes above it and masks of
/// hits and misses. 300 to 390 measured, of a camera's and a lidar's scans at 2.5 mm to 1 cm.
constexpr double bytes_of_brick = 400;

/// Readings inside the octree of this resolution, and their rays.
struct Reach {
  Scan scan;
  double length = 0, farthest = 0;  // m, of rays

  Reach(const Scan& whole, double resolution, double max_range) : scan(whole) {
    scan.origins.clear();
    scan.points.clear();
    const geometry::VoxelGrid grid(resolution);
    const Eigen::Isometry3f T_map_sensor = whole.T_map_sensor.cast<float>();
    for (const Eigen::Vector3f& point : whole.points)
      if (geometry::VoxelKey key; grid.key_of(T_map_sensor * point, key)) {
        scan.points.push_back(point);
        const double range = std::min(max_range, static_cast<double>(point.norm()));
        length += range;
        farthest = std::max(farthest, range);
      }
  }
};

double max_range_of(const Scan& scan, const OccupancyParameters& parameters) {
  return parameters.max_range.value_or(sensing::default_max_range(scan.sensor));
}

/// A ray crosses 1.5 bricks a brick's length, the mean over directions; as if each were alone.
double most_bricks(const Reach& reach, double resolution) {
  return static_cast<double>(reach.scan.points.size()) + 1.5 * reach.length / (brick_edge * resolution);
}

/// Voxels of this edge that rays meet.
double voxels_met(const Scan& scan, const OccupancyParameters& parameters, double edge) {
  const geometry::VoxelGrid grid(edge);
  sensing::Downsampler downsample(grid);
  occupancy::RayTracer trace(grid);
  const sensing::VoxelScan voxels = downsample(scan, parameters.min_range, max_range_of(scan, parameters));
  std::size_t met = 0;
  for (const occupancy::TouchedBlock& block : trace(voxels, downsample, 1).blocks)
    for (unsigned word = 0; word < 8; ++word)
      met += static_cast<std::size_t>(std::popcount(block.misses[word] | block.hits[word]));
  return static_cast<double>(met);
}

/// Bricks of the octree that a scan's rays meet.
double bricks_met(const Scan& whole, const OccupancyParameters& parameters, double resolution) {
  const Reach reach(whole, resolution, max_range_of(whole, parameters));
  // Rays are traced through coarse cells, which takes no time. With smaller ones the number grows as with the
  // last halving: eightfold where rays are dense, twofold where each is alone.
  constexpr double cells = 128;  // to the farthest reading
  const double brick = brick_edge * resolution, edge = std::max(brick, reach.farthest / cells);
  const double met = voxels_met(reach.scan, parameters, edge);
  const double growth = met / std::max(1.0, voxels_met(reach.scan, parameters, 2 * edge));
  return std::min(most_bricks(reach, resolution), met * std::pow(growth, std::log2(edge / brick)));
}

/// Rounded up to two digits.
double two_digits(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::ceil(value / unit - 1e-6) * unit;
}

/// The least resolution, in steps of a quarter, at which a scan's rays meet this many bricks.
double resolution_for(const Scan& scan, const OccupancyParameters& parameters, double bricks) {
  constexpr double step = 1.25, coarsest = 1;  // m
  double resolution = parameters.resolution * step;
  while (resolution < coarsest && bricks_met(scan, parameters, resolution) > bricks) resolution *= step;
  return two_digits(resolution);
}

template <class... Values>
std::string printed(const char* format, Values... values) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

constexpr double giga = 1e9;  // bytes

}  // namespace

void require_memory(const Scan& scan, const OccupancyParameters& parameters, std::uint64_t available) {
  const auto left = static_cast<double>(available);
  const double resolution = parameters.resolution;
  if (available == 0 ||
      bytes_of_brick * most_bricks({scan, resolution, max_range_of(scan, parameters)}, resolution) < left)
    return;
  const double bytes = bytes_of_brick * bricks_met(scan, parameters, resolution);
  if (bytes < left) return;
  throw Error(
      Error::Kind::data, scan.name,
      printed("takes about %.2g GB to map at %g m, and there are %.2g GB", bytes / giga, resolution,
              left / giga),
      printed("--resolution %g or more", resolution_for(scan, parameters, left / 2 / bytes_of_brick)));
}

std::string cost_warning(const FirstScans& first, const Scan& scan, const OccupancyParameters& parameters,
                         std::uint64_t available) {
  if (first.count < 2) return {};
  const auto scans = static_cast<double>(first.count), left = static_cast<double>(first.left);
  const double a_scan = (first.bytes - first.bytes_first) / (scans - 1), more = a_scan * left;
  constexpr double long_s = 1;  // below that nobody waits for a scan, however often they come
  const bool too_large = available > 0 && more > static_cast<double>(available);
  const bool too_slow = first.scan_s > std::max(long_s, first.interval_s);
  if (!too_large && !too_slow) return {};
  double share = 1;  // of the voxels, that may be met
  std::string what = "at " + printed("%g m", parameters.resolution);
  if (too_large) {
    share = static_cast<double>(available) / 2 / more;
    what +=
        printed(" the map grows by %.2g GB a scan; where the sensor moves on, %zu more need %.2g of %.2g GB",
                a_scan / giga, first.left, more / giga, static_cast<double>(available) / giga);
  }
  if (too_slow) {
    share = std::min(share, long_s / first.scan_s);
    what += printed("%s a scan takes %.1f s, %.2g times the interval; %zu more take %.2g minutes",
                    too_large ? ", and" : "", first.scan_s, first.scan_s / std::max(1e-3, first.interval_s),
                    first.left, left * first.scan_s / 60);
  }
  const double bricks = share * bricks_met(scan, parameters, parameters.resolution);
  return what +
         printed(": --resolution %g meets 1/%.0f of the voxels", resolution_for(scan, parameters, bricks),
                 1 / share) +
         (too_large ? "; --max-memory keeps parts in a file" : "");
}

std::string spacing_warning(const Scan& scan, const Parameters& parameters) {
  std::vector<Eigen::Vector3f> points;
  const double max_range = max_range_of(scan, parameters.occupancy);
  for (const Eigen::Vector3f& point : scan.points)
    if (const double range = point.norm(); range > parameters.occupancy.min_range && range <= max_range)
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
  const double d = parameters.occupancy.resolution;
  return scan.name + printed(
                         ": readings lie %.2g m apart, too far for surfaces at %g m: --resolution %g or more "
                         "finds them, in less time and memory",
                         spacing, d, two_digits(std::min(1.0, scatter * across / hole * d)));
}

std::uint64_t available_memory() {
  std::ifstream lines("/proc/meminfo");
  for (std::string name; lines >> name; lines.ignore(std::numeric_limits<std::streamsize>::max(), '\n'))
    if (std::uint64_t kib = 0; name == "MemAvailable:" && lines >> kib) return kib << 10;
  return 0;
}

}  // namespace octosurf
