#include "geometry/even_odd.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <octosurf/diagnosis.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
namespace {

/// Intersections of a surface's polygons with lines of constant v, some step apart: even-odd over all rings.
class Rows {
 public:
  Rows(double first_v, double step, std::size_t count) : first_v_(first_v), step_(step), crossings_(count) {}

  void add(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const auto [low, high] = a.y() < b.y() ? std::pair(a, b) : std::pair(b, a);
    // Rows with low.y ≤ v < high.y, so that a vertex on a row counts once.
    const double last = std::ceil((high.y() - first_v_) / step_);
    for (double row = std::max(0.0, std::ceil((low.y() - first_v_) / step_));
         row < last && row < static_cast<double>(crossings_.size()); ++row)
      crossings_[static_cast<std::size_t>(row)].push_back(geometry::crossing(low, high, v_of(row)));
  }
  void sort() {
    for (std::vector<double>& row : crossings_) std::sort(row.begin(), row.end());
  }
  double v_of(double row) const { return first_v_ + row * step_; }
  const std::vector<double>& operator[](std::size_t row) const { return crossings_[row]; }

 private:
  double first_v_, step_;
  std::vector<std::vector<double>> crossings_;  // ascending u; inside between an even and the next odd one
};

Eigen::AlignedBox3d box_of(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Polygon& polygon : surface.polygons)
    for (const Eigen::Vector2d& uv : polygon.outer) box.extend(surface.to_map(uv));
  return box;
}

/// Mean of |h| along an interval on which h is linear from h0 to h1.
double mean_distance(double h0, double h1) {
  const double a = std::fabs(h0), b = std::fabs(h1);
  if ((h0 < 0) == (h1 < 0) || a + b == 0) return (a + b) / 2;
  return (a * a + b * b) / (2 * (a + b));
}

/// The overlap of two surfaces, measured in the plane of the smaller one.
class Overlap {
 public:
  Overlap(const Surface& smaller, const Surface& larger, double step, double max_distance)
      : max_distance_(max_distance) {
    // The larger one's height over the smaller one's (u, v) is h0 + slope·(u, v).
    const Eigen::Vector3d normal = smaller.T_map_surface.linear().transpose() * larger.plane.normal;
    slope_ = -normal.head<2>() / normal.z();
    h0_ = -larger.plane.signed_distance(smaller.T_map_surface.translation()) / normal.z();

    const Eigen::Isometry3d T = smaller.T_map_surface.inverse() * larger.T_map_surface;
    const Rings own = rings_of(smaller, Eigen::Isometry3d::Identity()), other = rings_of(larger, T);
    const Eigen::AlignedBox2d common = own.box.intersection(other.box);
    if (common.isEmpty()) return;
    const auto count = static_cast<std::size_t>(std::ceil(common.sizes().y() / step));
    if (count == 0) return;
    step_ = common.sizes().y() / static_cast<double>(count);
    const Rows empty(common.min().y() + step_ / 2, step_, count);
    const Rows own_rows = filled(empty, own), other_rows = filled(empty, other);
    for (std::size_t row = 0; row < count; ++row)
      meet(own_rows[row], other_rows[row], empty.v_of(static_cast<double>(row)));
  }

  double area_m2() const { return area_; }
  double mean_distance_m() const { return area_ > 0 ? distance_sum_ / area_ : 0; }

 private:
  struct Rings {
    std::vector<Ring2> rings;
    Eigen::AlignedBox2d box;
  };

  /// All rings, projected along z after T.
  static Rings rings_of(const Surface& surface, const Eigen::Isometry3d& T) {
    Rings result;
    const auto add = [&](const Ring2& ring) {
      Ring2& moved = result.rings.emplace_back();
      for (const Eigen::Vector2d& uv : ring) {
        moved.emplace_back((T * Eigen::Vector3d(uv.x(), uv.y(), 0)).head<2>());
        result.box.extend(moved.back());
      }
    };
    for (const Polygon& polygon : surface.polygons) {
      add(polygon.outer);
      for (const Ring2& hole : polygon.holes) add(hole);
    }
    return result;
  }

  static Rows filled(Rows rows, const Rings& rings) {
    for (const Ring2& ring : rings.rings)
      for (std::size_t i = 0; i < ring.size(); ++i) rows.add(ring[i], ring[(i + 1) % ring.size()]);
    rows.sort();
    return rows;
  }

  /// Intersection of two ascending lists of intervals in one pass.
  void meet(const std::vector<double>& a, const std::vector<double>& b, double v) {
    for (std::size_t i = 0, j = 0; i + 1 < a.size() && j + 1 < b.size();) {
      add(std::max(a[i], b[j]), std::min(a[i + 1], b[j + 1]), v);
      (a[i + 1] < b[j + 1] ? i : j) += 2;
    }
  }

  /// Adds the part of [from, to] where the planes are near.
  void add(double from, double to, double v) {
    const double at_zero = h0_ + slope_.y() * v;
    const auto height = [&](double u) { return at_zero + slope_.x() * u; };
    if (std::fabs(slope_.x()) > 1e-12) {
      const double u1 = (-max_distance_ - at_zero) / slope_.x(), u2 = (max_distance_ - at_zero) / slope_.x();
      from = std::max(from, std::min(u1, u2));
      to = std::min(to, std::max(u1, u2));
    } else if (std::fabs(at_zero) > max_distance_) {
      return;
    }
    if (from >= to) return;
    area_ += (to - from) * step_;
    distance_sum_ += (to - from) * step_ * mean_distance(height(from), height(to));
  }

  double max_distance_, step_ = 0;
  Eigen::Vector2d slope_;
  double h0_ = 0, area_ = 0, distance_sum_ = 0;
};

void require(bool holds, const char* field, double value, const char* rule) {
  if (!holds) throw Error(Error::Kind::usage, field, "is " + std::to_string(value), rule);
}

}  // namespace

void DoubleLayerOptions::validate() const {
  require(max_angle_rad >= 0 && max_angle_rad <= std::numbers::pi / 4, "max_angle_rad", max_angle_rad,
          "must be in [0, pi/4]");
  require(max_distance_m > 0 && std::isfinite(max_distance_m), "max_distance_m", max_distance_m,
          "must be a length above 0 m");
  require(min_overlap > 0 && min_overlap <= 1, "min_overlap", min_overlap, "must be in (0, 1]");
}

std::vector<DoubleLayer> double_layers(const Snapshot& snapshot, const DoubleLayerOptions& options) {
  options.validate();
  constexpr double default_step = 0.005;  // m, if the snapshot has no resolution
  const double step = snapshot.resolution > 0 ? snapshot.resolution / 2 : default_step;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    boxes.push_back(box_of(*surface));
    // Enlarged by half of the distance, so that boxes of near surfaces meet.
    if (boxes.back().isEmpty()) continue;
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(options.max_distance_m / 2);
    boxes.back() = {boxes.back().min() - margin, boxes.back().max() + margin};
  }

  std::vector<DoubleLayer> layers;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = i + 1; j < boxes.size(); ++j) {
      const Surface &a = *snapshot.surfaces[i], &b = *snapshot.surfaces[j];
      if (!boxes[i].intersects(boxes[j])) continue;
      const double angle =
          std::atan2(a.plane.normal.cross(b.plane.normal).norm(), a.plane.normal.dot(b.plane.normal));
      if (angle > options.max_angle_rad) continue;
      const bool a_smaller = a.area_m2 <= b.area_m2;
      const Overlap overlap(a_smaller ? a : b, a_smaller ? b : a, step, options.max_distance_m);
      if (!(overlap.area_m2() > 0 &&
            overlap.area_m2() >= options.min_overlap * std::min(a.area_m2, b.area_m2)))
        continue;
      layers.push_back(
          {std::min(a.id, b.id), std::max(a.id, b.id), overlap.area_m2(), overlap.mean_distance_m(), angle});
    }
  return layers;
}

}  // namespace octosurf
