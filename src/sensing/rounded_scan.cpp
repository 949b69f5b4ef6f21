#include "sensing/rounded_scan.hpp"

#include "geometry/morton.hpp"
#include "sensing/reading_code.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

namespace octosurf::sensing {
namespace {

constexpr double independent = 8;  // readings in a voxel, as in accumulate_evidence()
constexpr double added_variance = 0.01;
constexpr std::uint32_t most_readings = 0xffff;  // that an archive can tell
constexpr int finest_bits = 8;                   // of a place in a voxel

void sort(VoxelScan& scan) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(scan.ends.size());
  for (const EndVoxel& end : scan.ends)
    order.emplace_back(geometry::morton_of(end.key.x, end.key.y, end.key.z),
                       static_cast<std::uint32_t>(order.size()));
  if (std::is_sorted(order.begin(), order.end())) return;
  std::sort(order.begin(), order.end());
  std::vector<EndVoxel> sorted;
  sorted.reserve(order.size());
  for (const auto& [morton, i] : order) sorted.push_back(scan.ends[i]);
  scan.ends = std::move(sorted);
}

std::uint32_t three_digits(std::uint32_t count) {
  const int idle = std::max(0, static_cast<int>(std::bit_width(count)) - 3);
  const std::uint32_t half = idle > 0 ? 1U << (idle - 1) : 0;
  return std::min((count + half) >> idle << idle, 0xe000U);  // the most with three digits
}

/// How many of a place's bits say nothing.
int idle_bits(double spread, std::uint32_t readings, double resolution) {
  const double n = independent * readings / (independent + readings);
  const double step = spread * std::sqrt(12 * added_variance / n);
  return std::clamp(static_cast<int>(std::floor(std::log2(step * 256 / resolution))), 0, finest_bits - 1);
}

/// The middle of 2^idle 256ths is where two of them meet: the upper is taken in one scan, the lower in the
/// next.
std::uint8_t middle_of(std::uint8_t place, int idle, unsigned lower) {
  if (idle == 0) return place;
  const unsigned begin = place >> idle << idle;
  return static_cast<std::uint8_t>(begin + (1U << (idle - 1)) - lower);
}

}  // namespace

void round_scan(VoxelScan& scan, const geometry::VoxelGrid& grid, const NoiseModel& noise) {
  sort(scan);
  const unsigned lower = scan.ends.size() % 2;  // as good as drawn
  for (EndVoxel& end : scan.ends) {
    if (!scan.within_range(grid.centre_of(end.key))) {
      end.count = 1;
      end.centroid = point_at(grid, end.key, {128, 128, 128});
      continue;
    }
    const unsigned range_class = range_class_of((end.centroid - scan.origin).norm());
    const int idle = idle_bits(noise.measured_sigma(range_class), end.count, grid.resolution());
    PlaceInVoxel place = place_in_voxel(grid, end.key, end.centroid);
    for (std::uint8_t& coordinate : place) coordinate = middle_of(coordinate, idle, lower);
    end.centroid = point_at(grid, end.key, place);
    end.count = three_digits(end.count);
  }
}

void restore_rounded(VoxelScan& scan, const geometry::VoxelGrid& grid) {
  sort(scan);
  for (EndVoxel& end : scan.ends) {
    end.centroid = point_at(grid, end.key, place_in_voxel(grid, end.key, end.centroid));
    end.count = std::min(end.count, most_readings);
  }
}

}  // namespace octosurf::sensing
