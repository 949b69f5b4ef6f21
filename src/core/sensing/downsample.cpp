#include "sensing/downsample.hpp"

#include "geometry/parallel.hpp"

#include <algorithm>
#include <array>
#include <span>

#include <octosurf/error.hpp>

namespace octosurf::sensing {
namespace {

/// A block of a scan's points in the map frame, with their voxels.
struct LocatedPoints {
  static constexpr std::size_t most = 256;
  std::array<float, most> x, y, z;  ///< map frame, m
  std::array<std::int32_t, most> key_x, key_y, key_z;
  std::array<std::int32_t, most> inside;  ///< 0: not finite, or outside the octree
};

// GCC's and Clang's vector extension: uses the target's vector registers, or plain code.
using Real = double __attribute__((vector_size(32)));
using Single = float __attribute__((vector_size(16)));
using Whole = std::int32_t __attribute__((vector_size(16)));

template <class V, class T>
[[gnu::always_inline]] inline void store(T* to, V v) {
  __builtin_memcpy(to, &v, sizeof v);
}

/// `rows`: 3×4, row-major.
[[gnu::always_inline]] inline void locate_fours(const Eigen::Vector3f* points, std::size_t fours,
                                                const double* rows, double per_metre, LocatedPoints& out) {
  constexpr double reach = geometry::VoxelGrid::origin;
  float* const positions[3] = {out.x.data(), out.y.data(), out.z.data()};
  std::int32_t* const keys[3] = {out.key_x.data(), out.key_y.data(), out.key_z.data()};
  for (std::size_t i = 0; i < 4 * fours; i += 4) {
    const Eigen::Vector3f* p = points + i;
    const Real x{p[0].x(), p[1].x(), p[2].x(), p[3].x()};
    const Real y{p[0].y(), p[1].y(), p[2].y(), p[3].y()};
    const Real z{p[0].z(), p[1].z(), p[2].z(), p[3].z()};
    Whole inside = Whole{} - 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const double* r = rows + 4 * a;
      const Single in_map = __builtin_convertvector(r[0] * x + r[1] * y + r[2] * z + r[3], Single);
      const Real scaled = __builtin_convertvector(in_map, Real) * per_metre;
      const auto in_reach = (scaled >= -reach) & (scaled < reach);
      inside &= __builtin_convertvector(in_reach, Whole);
      const Real safe = in_reach ? scaled : Real{};  // invalid keys must not overflow below
      const Whole cut = __builtin_convertvector(safe, Whole);
      // A comparison is −1 where true: corrects truncation toward zero to rounding down.
      const Whole below = __builtin_convertvector(safe < __builtin_convertvector(cut, Real), Whole);
      store(positions[a] + i, in_map);
      store(keys[a] + i, cut + below + geometry::VoxelGrid::origin);
    }
    store(out.inside.data() + i, inside);
  }
}

using Locate = void (*)(const Eigen::Vector3f*, std::size_t, const double*, double, LocatedPoints&);

void locate_anywhere(const Eigen::Vector3f* points, std::size_t fours, const double* rows, double per_metre,
                     LocatedPoints& out) {
  locate_fours(points, fours, rows, per_metre, out);
}
#if defined(__x86_64__)
// The same operations, a third faster in AVX's encoding.
[[gnu::target("avx2")]] void locate_with_avx2(const Eigen::Vector3f* points, std::size_t fours,
                                              const double* rows, double per_metre, LocatedPoints& out) {
  locate_fours(points, fours, rows, per_metre, out);
}
const Locate best = __builtin_cpu_supports("avx2") ? locate_with_avx2 : locate_anywhere;
#else
const Locate best = locate_anywhere;
#endif

/// Transforms up to LocatedPoints::most points to the map frame, in double, and finds their voxels as
/// VoxelGrid::key_of does. Four at a time, with the same rounding as one by one, with AVX2 or without. About
/// 4 ns a point.
void locate(std::span<const Eigen::Vector3f> points, const Eigen::Isometry3d& T_map_sensor,
            const geometry::VoxelGrid& grid, LocatedPoints& out) {
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = T_map_sensor.matrix().topRows<3>();
  const double per_metre = grid.per_metre();
  const std::size_t fours = points.size() / 4;
  best(points.data(), fours, rows.data(), per_metre, out);
  if (points.size() % 4 == 0) return;
  std::array<Eigen::Vector3f, 4> rest;
  for (std::size_t i = 0; i < 4; ++i) rest[i] = points[std::min(4 * fours + i, points.size() - 1)];
  LocatedPoints last;
  best(rest.data(), 1, rows.data(), per_metre, last);
  for (std::size_t i = 0; 4 * fours + i < points.size(); ++i) {
    const std::size_t to = 4 * fours + i;
    out.x[to] = last.x[i], out.y[to] = last.y[i], out.z[to] = last.z[i];
    out.key_x[to] = last.key_x[i], out.key_y[to] = last.key_y[i], out.key_z[to] = last.key_z[i];
    out.inside[to] = last.inside[i];
  }
}

}  // namespace

std::int64_t Downsampler::find(geometry::VoxelKey key) const {
  return std::int64_t{table_.find({key.x, key.y, key.z})} - 1;
}

void Downsampler::add(const Run& run, VoxelScan& out) {
  std::uint32_t& place = table_.at({run.key.x, run.key.y, run.key.z});
  if (place == 0) {
    out.ends.push_back({run.key, 0, 0, Eigen::Vector3f::Zero()});
    place = static_cast<std::uint32_t>(out.ends.size());
  }
  EndVoxel& end = out.ends[place - 1];
  end.count += run.count;
  end.centroid += run.sum;
}

/// A sensor moves through few voxels within a scan, and stays in one for a while: the last one is tried
/// first.
std::uint16_t Downsampler::start_of(const Eigen::Vector3f& origin, const Scan& scan,
                                    const Eigen::Isometry3d& T_map_sensor, VoxelScan& out) {
  const Eigen::Vector3f start = (T_map_sensor * origin.cast<double>()).cast<float>();
  geometry::VoxelKey key;
  if (!start.allFinite() || !grid_.key_of(start, key))
    throw Error(Error::Kind::data, scan.name, "a ray starts outside the octree's range",
                "check the scan's origins");
  const auto last = std::ranges::find(start_keys_.rbegin(), start_keys_.rend(), key);
  if (last != start_keys_.rend()) return static_cast<std::uint16_t>(start_keys_.rend() - last - 1);
  if (start_keys_.size() > std::numeric_limits<std::uint16_t>::max())
    throw Error(Error::Kind::data, scan.name, "its rays start in more than 65536 voxels",
                "divide it into scans, or use a larger resolution");
  start_keys_.push_back(key);
  out.starts.push_back(start);
  return static_cast<std::uint16_t>(start_keys_.size() - 1);
}

void Downsampler::collect_runs(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, double min_range,
                               std::size_t begin, std::size_t end, ThreadPart& part) const {
  const double min_range_sq = min_range * min_range;
  part.runs.clear();
  part.not_finite = part.too_near = part.out_of_map = 0;
  const bool moved = !scan.origins.empty();
  LocatedPoints located;
  for (std::size_t from = begin; from < end; from += LocatedPoints::most) {
    const std::span points(scan.points.data() + from, std::min(LocatedPoints::most, end - from));
    locate(points, T_map_sensor, grid_, located);
    Run run;
    Eigen::Vector3f centre = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool near = (moved ? Eigen::Vector3f(points[i] - scan.origins[from + i]) : points[i])
                            .cast<double>()
                            .squaredNorm() < min_range_sq;
      if (located.inside[i] == 0 || near) {
        ++(!points[i].allFinite() ? part.not_finite : near ? part.too_near : part.out_of_map);
        continue;
      }
      const geometry::VoxelKey key{static_cast<std::uint16_t>(located.key_x[i]),
                                   static_cast<std::uint16_t>(located.key_y[i]),
                                   static_cast<std::uint16_t>(located.key_z[i])};
      if (run.count == 0 || !(key == run.key)) {
        if (run.count > 0) part.runs.push_back(run);
        run = {key, 0, static_cast<std::uint32_t>(from + i), Eigen::Vector3f::Zero()};
        centre = grid_.centre_of(key);
      }
      ++run.count;
      run.sum += Eigen::Vector3f(located.x[i], located.y[i], located.z[i]) - centre;
    }
    if (run.count > 0) part.runs.push_back(run);
  }
}

void Downsampler::add_free_rays(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, VoxelScan& out) {
  for (const Eigen::Vector3f& ray : scan.free_rays) {
    geometry::VoxelKey key;
    if (!ray.allFinite() || !grid_.key_of((T_map_sensor * ray.cast<double>()).cast<float>().eval(), key))
      continue;
    std::uint32_t& place = table_.at({key.x, key.y, key.z});
    if (place != 0) continue;
    out.ends.push_back({key, 0, 0, grid_.centre_of(key)});
    place = static_cast<std::uint32_t>(out.ends.size());
    if (!scan.origins.empty())
      out.ends.back().start = start_of(Eigen::Vector3f::Zero(), scan, T_map_sensor, out);
  }
}

VoxelScan Downsampler::operator()(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, double min_range,
                                  double max_range, int threads) {
  VoxelScan out;
  out.origin = T_map_sensor.translation().cast<float>();
  out.max_range = max_range;
  if (geometry::VoxelKey key; !grid_.key_of(out.origin, key))
    throw Error(Error::Kind::data, scan.name, "the sensor is outside the octree's range",
                "check that poses are in metres; --origin X Y Z shifts all coordinates");
  if (!scan.origins.empty() && scan.origins.size() != scan.points.size())
    throw Error(Error::Kind::data, scan.name,
                std::to_string(scan.origins.size()) + " rays' origins for " +
                    std::to_string(scan.points.size()) + " readings",
                "give one to each, or none");
  table_.clear();
  start_keys_.clear();
  // Runs end at the same points for any number of threads, so sums round equally.
  const std::size_t stretches = scan.points.size() / LocatedPoints::most + 1;
  parts_.resize(std::min(static_cast<std::size_t>(threads), stretches));
  geometry::in_parallel(static_cast<int>(parts_.size()), [&](int t) {
    const geometry::Share share(stretches, t, static_cast<int>(parts_.size()));
    collect_runs(scan, T_map_sensor, min_range, share.begin * LocatedPoints::most,
                 std::min(share.end * LocatedPoints::most, scan.points.size()),
                 parts_[static_cast<std::size_t>(t)]);
  });
  for (const ThreadPart& part : parts_) {
    for (const Run& run : part.runs) {
      const std::size_t ends = out.ends.size();
      add(run, out);
      if (!scan.origins.empty() && out.ends.size() > ends)
        out.ends.back().start = start_of(scan.origins[run.first], scan, T_map_sensor, out);
    }
    out.not_finite += part.not_finite;
    out.too_near += part.too_near;
    out.out_of_map += part.out_of_map;
  }
  for (EndVoxel& end : out.ends) {
    const Eigen::Vector3f centre = grid_.centre_of(end.key);
    if (!out.within_range(end, centre)) out.beyond_range += end.count;
    end.centroid = centre + end.centroid / static_cast<float>(end.count);
  }
  add_free_rays(scan, T_map_sensor, out);
  return out;
}

}  // namespace octosurf::sensing
