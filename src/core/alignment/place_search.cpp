#include "alignment/place_search.hpp"

#include "alignment/plane_match.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <tuple>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::alignment {
namespace {

using Point = std::array<std::int16_t, 3>;

}  // namespace

CellPyramid::CellPyramid(const OccupancyView& octree, double least_edge) : edge_(2 * octree.resolution()) {
  constexpr double most_cells = 1 << 26;  // of a byte each
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9));
  std::vector<Eigen::Vector3f> matter;
  Eigen::AlignedBox3d box;
  octree.for_each_occupied(everywhere, [&](const OccupancyView::Voxel& voxel) {
    matter.push_back(voxel.center.cast<float>());
    box.extend(voxel.center);
    return true;
  });
  if (matter.empty()) return;
  while (edge_ < least_edge || (box.sizes() / edge_).prod() > most_cells) edge_ *= 2;
  // From a voxel's corner, and one cell more for what is widened.
  low_ = box.min().array() - octree.resolution() / 2 - edge_;
  size_ = ((box.max() - low_) / edge_).array().cast<int>() + 2;
  levels_.assign(static_cast<std::size_t>(size_.prod()), top + 1);
  for (const Eigen::Vector3f& at : matter) {
    // The cells that the half one, half a cell larger on all sides, meets.
    const Eigen::Array3i half = ((at.cast<double>() - low_) / edge_ * 2).array().cast<int>() - 1;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Array3i cell = (half + 2 * Eigen::Array3i(corner & 1, corner >> 1 & 1, corner >> 2)) / 2;
      levels_[index_of(cell.x(), cell.y(), cell.z())] = 0;
    }
  }
  widen();
}

void CellPyramid::widen() {
  std::vector<std::uint8_t> here(levels_.size());  // whether a window of the level has matter
  for (std::size_t i = 0; i < here.size(); ++i) here[i] = levels_[i] == 0 ? 1 : 0;
  const auto nx = static_cast<std::size_t>(size_.x()), ny = static_cast<std::size_t>(size_.y());
  for (int level = 1; level <= top; ++level) {
    std::size_t stride = 1, period = nx;
    for (const int axis : {0, 1, 2}) {
      const std::size_t by = stride << (level - 1);
      for (std::size_t line = 0; line < here.size(); line += period)  // upwards: what is read is as before
        for (std::size_t i = line; i + by < line + period; ++i) here[i] |= here[i + by];
      stride = period;
      period *= axis == 0 ? ny : static_cast<std::size_t>(size_.z());
    }
    for (std::size_t i = 0; i < here.size(); ++i)
      levels_[i] = here[i] != 0 ? std::min(levels_[i], static_cast<std::uint8_t>(level)) : levels_[i];
  }
}

Scan joined(std::span<const Scan> scans) {
  if (scans.empty()) throw Error(Error::Kind::usage, "scans", "are none", "give one or more");
  constexpr std::size_t most_scans = 16, most_readings = 48000;
  const std::size_t count = std::min(most_scans, scans.size());
  const Scan& last = scans.back();
  for (const Scan& scan : scans) require_rigid(scan.T_map_sensor, scan.name);
  Scan run;
  run.name = last.name;
  run.sensor = last.sensor;
  run.T_map_sensor = last.T_map_sensor;
  for (std::size_t k = 1; k <= count; ++k) {
    const Scan& scan = scans[k * scans.size() / count - 1];
    const Eigen::Isometry3f T = (last.T_map_sensor.inverse() * scan.T_map_sensor).cast<float>();
    const std::size_t size = scan.points.size(), rows = most_readings / count / most_in_a_row;
    const bool all = size <= rows * most_in_a_row;
    for (std::size_t row = 0; row < (all ? 1 : rows); ++row) {
      const double place = std::fmod(static_cast<double>(row) * std::numbers::phi, 1);
      const auto first = all ? 0 : static_cast<std::size_t>(place * static_cast<double>(size));
      for (std::size_t i = first; i < (all ? size : std::min(size, first + most_in_a_row)); ++i) {
        run.points.push_back(T * scan.points[i]);
        run.origins.push_back(i < scan.origins.size() ? T * scan.origins[i]
                                                      : Eigen::Vector3f(T.translation()));
      }
    }
  }
  return run;
}

namespace {

/// Points of a run, about its sensor and in its given axes: readings of patches, in turn one of each kind by
/// the way they face, so that a floor does not outweigh what tells places apart.
std::vector<Eigen::Vector3d> points_of(const Scan& run, const sensing::NoiseModel& noise,
                                       const RangeLimits& range, double resolution, std::size_t most,
                                       const Eigen::Vector3d& up) {
  constexpr std::size_t aside = 12, kinds = aside + 3;
  std::array<std::vector<Eigen::Vector3d>, kinds> of_kind;
  std::vector<ScanPatch> patches = patches_of(run, noise, range, resolution);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < patches.size(); ++i)
    order.emplace_back(std::fmod(static_cast<double>(i) * std::numbers::phi, 1), i);
  std::ranges::sort(order);
  const Eigen::Vector3d x = up.unitOrthogonal(), y = up.cross(x);
  for (const auto& [place, i] : order) {
    ScanPatch& patch = patches[i];
    std::size_t kind = aside + 2;
    const bool flat = patch.fit_plane();
    const Eigen::Vector3d normal = run.T_map_sensor.linear() * patch.normal;
    if (const double slope = normal.dot(up); flat && std::fabs(slope) > 0.9)
      kind = aside + (slope > 0 ? 0 : 1);
    else if (flat && std::fabs(slope) < 0.3)
      kind = static_cast<std::size_t>((std::atan2(normal.dot(y), normal.dot(x)) / std::numbers::pi + 1) *
                                      aside / 2) %
             aside;
    of_kind[kind].emplace_back(run.T_map_sensor.linear() * patch.reading);
  }
  std::vector<Eigen::Vector3d> points;
  for (std::size_t k = 0; points.size() < most; ++k) {
    const std::size_t before = points.size();
    for (const auto& some : of_kind)
      if (k < some.size() && points.size() < most) points.push_back(some[k]);
    if (points.size() == before) break;
  }
  return points;
}

/// A run turned one way, in cells about its sensor, and the translations at which most of it may meet the
/// map.
struct Turned {
  Eigen::Matrix3d R;
  std::size_t tilt;
  double turn_rad;
  std::vector<Point> points;
  Eigen::Array3i low, high;  ///< the latter excluded
};

struct Node {
  std::uint16_t score;  ///< points that may lie on matter
  std::uint8_t level;   ///< of translations `at` … `at` + 2^level − 1
  std::uint32_t turned;
  Point at;
  /// Best first; of equals the smaller block, and a fixed order.
  bool operator<(const Node& other) const {
    return std::tie(score, other.level, other.turned, other.at) < std::tie(other.score, level, turned, at);
  }
};

class Search {
 public:
  Search(const CellPyramid& cells, std::size_t points, const PlaceLimits& limits)
      : cells_(cells),
        limits_(limits),
        least_(static_cast<std::size_t>(std::ceil(limits.least_share * static_cast<double>(points)))) {}

  void add(Turned turned) {
    const int step = 1 << CellPyramid::top;
    turned_.push_back(std::move(turned));
    const auto index = static_cast<std::uint32_t>(turned_.size() - 1);
    const Eigen::Array3i low = turned_.back().low, high = turned_.back().high;
    for (int z = low.z(); z < high.z(); z += step)
      for (int y = low.y(); y < high.y(); y += step)
        for (int x = low.x(); x < high.x(); x += step) push(index, {x, y, z}, CellPyramid::top);
  }

  Places run(const Eigen::Isometry3d& T_given_sensor) {
    Places places;
    std::vector<Node> found;
    while (!queue_.empty() && queue_.top().score >= least_) {
      const Node node = queue_.top();
      queue_.pop();
      if (is_near_one(node, found)) continue;
      if (node.level == 0) {
        if (found.empty())
          least_ = std::max(least_, static_cast<std::size_t>(limits_.near_best * node.score));
        found.push_back(node);
        places.complete = found.size() < limits_.most_places;
        if (!places.complete) break;
        continue;
      }
      if (looked_at_ > limits_.most_nodes) {
        places.complete = false;
        break;
      }
      const int half = 1 << (node.level - 1);
      for (int c = 0; c < 8; ++c)
        push(node.turned,
             Eigen::Array3i(node.at[0] + (c & 1) * half, node.at[1] + (c >> 1 & 1) * half,
                            node.at[2] + (c >> 2) * half),
             node.level - 1);
    }
    for (const Node& node : found) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() = turned_[node.turned].R * T_given_sensor.linear();
      pose.translation() = place_of(node);
      places.poses.push_back(pose);
    }
    return places;
  }

 private:
  Eigen::Vector3d place_of(const Node& node) const {
    return cells_.low() + cells_.edge() * Eigen::Vector3d(node.at[0], node.at[1], node.at[2]);
  }
  bool is_near_one(const Node& node, const std::vector<Node>& found) const {
    const Turned& turned = turned_[node.turned];
    const double rest = cells_.edge() * ((1 << node.level) - 1);  // of the block, beyond its first place
    const Eigen::Vector3d low = place_of(node);
    return std::ranges::any_of(found, [&](const Node& other) {
      const Turned& theirs = turned_[other.turned];
      if (theirs.tilt != turned.tilt || std::fabs(std::remainder(theirs.turn_rad - turned.turn_rad,
                                                                 2 * std::numbers::pi)) > limits_.apart_rad)
        return false;
      const Eigen::Vector3d to_low = place_of(other) - low;
      const Eigen::Vector3d far = to_low.cwiseAbs().cwiseMax((to_low.array() - rest).matrix().cwiseAbs());
      return far.squaredNorm() <= limits_.apart_m * limits_.apart_m;
    });
  }
  void push(std::uint32_t index, const Eigen::Array3i& at, int level) {
    const Turned& turned = turned_[index];
    if ((at >= turned.high).any()) return;
    ++looked_at_;
    std::size_t score = 0, left = turned.points.size();
    for (const Point& p : turned.points) {
      score += cells_.any(p[0] + at.x(), p[1] + at.y(), p[2] + at.z(), level) ? 1 : 0;
      if (score + --left < least_) return;
    }
    queue_.push({static_cast<std::uint16_t>(score),
                 static_cast<std::uint8_t>(level),
                 index,
                 {static_cast<std::int16_t>(at.x()), static_cast<std::int16_t>(at.y()),
                  static_cast<std::int16_t>(at.z())}});
  }

  const CellPyramid& cells_;
  const PlaceLimits& limits_;
  std::size_t least_, looked_at_ = 0;
  std::vector<Turned> turned_;
  std::priority_queue<Node> queue_;
};

Turned turned_by(const Eigen::Matrix3d& R, std::span<const Eigen::Vector3d> points, const CellPyramid& cells,
                 const Eigen::AlignedBox3d& region) {
  Turned turned{R, 0, 0, {}, {}, {}};
  std::array<std::vector<int>, 3> along;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Array3i cell = (R * p / cells.edge()).array().floor().cast<int>();
    turned.points.push_back({static_cast<std::int16_t>(cell.x()), static_cast<std::int16_t>(cell.y()),
                             static_cast<std::int16_t>(cell.z())});
    for (std::size_t i = 0; i < 3; ++i) along[i].push_back(cell[static_cast<Eigen::Index>(i)]);
  }
  // Half of the points lie in the cells' box only where the middle one does, along each axis.
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    auto middle = along[i].begin() + static_cast<std::ptrdiff_t>(along[i].size() / 2);
    std::ranges::nth_element(along[i], middle);
    turned.low[axis] = -*middle - 1;
    turned.high[axis] = cells.size()[axis] - *middle + 1;
    if (region.isEmpty()) continue;
    const auto cell_of = [&](double at) { return (at - cells.low()[axis]) / cells.edge(); };
    turned.low[axis] = std::max(turned.low[axis], static_cast<int>(std::floor(cell_of(region.min()[axis]))));
    turned.high[axis] =
        std::min(turned.high[axis], static_cast<int>(std::ceil(cell_of(region.max()[axis]))) + 1);
  }
  return turned;
}

}  // namespace

Places search_places(const CellPyramid& cells, const Scan& run, const sensing::NoiseModel& noise,
                     const RangeLimits& range, double resolution, const Eigen::Vector3d& up,
                     std::span<const Eigen::Matrix3d> tilts, const Eigen::AlignedBox3d& region,
                     const PlaceLimits& limits) {
  const std::vector<Eigen::Vector3d> points = points_of(run, noise, range, resolution, limits.points, up);
  if (points.empty() || cells.size().isZero()) return {};
  std::vector<double> ranges;
  for (const Eigen::Vector3d& p : points) ranges.push_back(p.norm());
  std::ranges::sort(ranges);
  const double far = std::max(cells.edge(), ranges[ranges.size() * 9 / 10]);
  const auto turns = static_cast<int>(std::ceil(2 * std::numbers::pi * far / cells.edge()));
  Search search(cells, points.size(), limits);
  for (std::size_t tilt = 0; tilt < tilts.size(); ++tilt)
    for (int i = 0; i < turns; ++i) {
      const double turn_rad = 2 * std::numbers::pi * i / turns;
      Turned turned = turned_by(Eigen::AngleAxisd(turn_rad, up) * tilts[tilt], points, cells, region);
      turned.tilt = tilt;
      turned.turn_rad = turn_rad;
      search.add(std::move(turned));
    }
  return search.run(run.T_map_sensor);
}

}  // namespace octosurf::alignment
