#include "occupancy/grazing.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::occupancy {
namespace {

/// Cube map: the face is that of the largest component, the others are divided by it.
struct CubeDirection {
  int face;
  float u, v;  // in [−1, 1]
};

CubeDirection cube_direction(const Eigen::Vector3f& d) {
  int axis = 0;
  const float largest = d.cwiseAbs().maxCoeff(&axis);
  const int face = 2 * axis + (d[axis] < 0 ? 1 : 0);
  return {face, d[(axis + 1) % 3] / largest, d[(axis + 2) % 3] / largest};
}

int cell_of(float c, int cells) {
  return std::clamp(static_cast<int>((c + 1) * 0.5F * static_cast<float>(cells)), 0, cells - 1);
}

bool segment_meets_box(const Eigen::Vector3f& from, const Eigen::Vector3f& to, const Eigen::Vector3f& centre,
                       float half) {
  float enter = 0, leave = 1;
  for (int a = 0; a < 3; ++a) {
    const float d = to[a] - from[a];
    const float low = centre[a] - half - from[a], high = centre[a] + half - from[a];
    if (std::fabs(d) < 1e-9F) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    enter = std::max(enter, std::min(low / d, high / d));
    leave = std::min(leave, std::max(low / d, high / d));
  }
  return enter <= leave;
}

}  // namespace

Eigen::Vector3f GrazingTest::end_of(const sensing::EndVoxel& end) const {
  const Eigen::Vector3f centre = grid_.centre_of(end.key);
  if (scan_.within_range(end, centre)) return centre;
  return scan_.origin + (centre - scan_.origin).normalized() * static_cast<float>(scan_.max_range);
}

int GrazingTest::bin_of(const Eigen::Vector3f& direction) {
  const CubeDirection c = cube_direction(direction);
  return (c.face * cells + cell_of(c.v, cells)) * cells + cell_of(c.u, cells);
}

void GrazingTest::index() {
  first_.assign(static_cast<std::size_t>(6 * cells * cells) + 1, 0);
  ends_.resize(scan_.ends.size());
  std::vector<int> bins(scan_.ends.size());
  std::vector<Eigen::Vector3f> points(scan_.ends.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = end_of(scan_.ends[i]);
    bins[i] = bin_of(points[i] - scan_.origin);
    ++first_[static_cast<std::size_t>(bins[i]) + 1];
  }
  for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i)
    ends_[next[static_cast<std::size_t>(bins[i])]++] = points[i];
}

bool GrazingTest::crosses(geometry::VoxelKey voxel, const Plane& plane, double tolerance) {
  if (first_.empty()) index();
  const double side = plane.signed_distance(scan_.origin.cast<double>());
  const Eigen::Vector3f centre = grid_.centre_of(voxel);
  const Eigen::Vector3f direction = centre - scan_.origin;
  const float half = static_cast<float>(grid_.resolution() / 2);
  const Eigen::Vector3f n = plane.normal.cast<float>();

  const auto beyond = [&](const Eigen::Vector3f& end) {
    const double end_side = static_cast<double>(n.dot(end)) - plane.offset;
    return side > 0 ? end_side < -tolerance : end_side > tolerance;
  };
  const auto any_in_face = [&](int axis, bool negative) {
    // The voxel's corners, projected onto the face: at most 2·half / (depth − half) from its centre.
    const float depth = std::fabs(direction[axis]);
    const bool whole = depth < 2 * half;
    const float u = whole ? 0 : direction[(axis + 1) % 3] / depth,
                v = whole ? 0 : direction[(axis + 2) % 3] / depth;
    const float reach = whole ? 1 : 2.05F * half / (depth - half);
    const int face = 2 * axis + (negative ? 1 : 0);
    for (int y = cell_of(v - reach, cells); y <= cell_of(v + reach, cells); ++y)
      for (int x = cell_of(u - reach, cells); x <= cell_of(u + reach, cells); ++x) {
        const auto bin = static_cast<std::size_t>((face * cells + y) * cells + x);
        for (std::uint32_t i = first_[bin]; i < first_[bin + 1]; ++i)
          if (beyond(ends_[i]) && segment_meets_box(scan_.origin, ends_[i], centre, half)) return true;
      }
    return false;
  };
  const float largest = direction.cwiseAbs().maxCoeff();
  if (!(largest > half)) return true;  // the sensor stands in the voxel
  // A voxel near a face's border also projects onto the next face; one beside the sensor onto the opposite
  // one.
  for (int axis = 0; axis < 3; ++axis) {
    const float depth = std::fabs(direction[axis]);
    if (depth + 2 * half < largest) continue;
    if (any_in_face(axis, direction[axis] < 0) || (depth < half && any_in_face(axis, direction[axis] >= 0)))
      return true;
  }
  return false;
}

}  // namespace octosurf::occupancy
