#include "cylinders/normal_field.hpp"

#include "geometry/lanes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace octosurf::cylinders {
namespace {

/// Weighted sums over neighbours relative to the query point.
struct NeighbourSums {
  float count = 0, weight = 0;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  std::array<float, 6> outer{};  // xx xy xz yy yz zz
};

/// Accumulates neighbours, four per step. Their order determines the rounding, so it must be fixed.
class NeighbourMoments {
 public:
  NeighbourMoments(const occupancy::VoxelPoint& centre, float radius)
      : centre_(centre), radius_sq_(radius * radius), per_radius_sq_(1 / radius_sq_) {}

  /// Points [first, first + count) of the window, eight at most.
  void add(const occupancy::PointWindow::Columns& points, std::size_t first, unsigned count) {
    place(points, first, filled_);
    if (count > 4) place(points, first + 4, filled_ + 4);
    filled_ += count;
    if (filled_ < capacity) return;
    sum_up(capacity);
    filled_ -= capacity;
    for (std::array<float, room>* column : {&offset_x_, &offset_y_, &offset_z_, &facing_})
      std::memcpy(column->data(), column->data() + capacity, longest * sizeof(float));
  }

  NeighbourSums sums() {
    for (; filled_ % 4 != 0; ++filled_) {  // pads the last four with zeros
      offset_x_[filled_] = offset_y_[filled_] = offset_z_[filled_] = 0;
      facing_[filled_] = opposite;
    }
    sum_up(filled_);
    return {geometry::total(count_),
            geometry::total(weight_),
            {geometry::total(x_), geometry::total(y_), geometry::total(z_)},
            {geometry::total(xx_), geometry::total(xy_), geometry::total(xz_), geometry::total(yy_),
             geometry::total(yz_), geometry::total(zz_)}};
  }

 private:
  static constexpr std::size_t capacity = 64, longest = 8, room = capacity + longest;
  static constexpr float opposite = -1;

  /// Four points; surplus ones are overwritten later.
  void place(const occupancy::PointWindow::Columns& points, std::size_t from, std::size_t to) {
    const Eigen::Vector3f &p = centre_.position, &view = centre_.view;
    geometry::store_lanes(geometry::load_lanes(&points.x[from]) - p.x(), &offset_x_[to]);
    geometry::store_lanes(geometry::load_lanes(&points.y[from]) - p.y(), &offset_y_[to]);
    geometry::store_lanes(geometry::load_lanes(&points.z[from]) - p.z(), &offset_z_[to]);
    geometry::store_lanes(geometry::load_lanes(&points.view_x[from]) * view.x() +
                              (geometry::load_lanes(&points.view_y[from]) * view.y() +
                               geometry::load_lanes(&points.view_z[from]) * view.z()),
                          &facing_[to]);
  }

  /// exp(−t) for t in [0, 1] to 3e-4: Taylor about 1/2.
  static geometry::Lanes exp_minus(geometry::Lanes t) {
    constexpr float exp_minus_half = 0.60653066F;
    const geometry::Lanes u = 0.5F - t;
    return exp_minus_half * (1.0F + u * (1.0F + u * (0.5F + u * (1.0F / 6 + u * (1.0F / 24)))));
  }

  void sum_up(std::size_t filled) {
    geometry::Lanes count = count_, weight = weight_, sx = x_, sy = y_, sz = z_;  // registers during the loop
    geometry::Lanes xx = xx_, xy = xy_, xz = xz_, yy = yy_, yz = yz_, zz = zz_;
    for (std::size_t i = 0; i < filled; i += 4) {
      const geometry::Lanes x = geometry::load_lanes(&offset_x_[i]), y = geometry::load_lanes(&offset_y_[i]),
                            z = geometry::load_lanes(&offset_z_[i]);
      const geometry::Lanes distance_sq = x * x + y * y + z * z;
      const geometry::LaneMask counts =
          (distance_sq <= radius_sq_) & (geometry::load_lanes(&facing_[i]) >= -0.3F);
      const geometry::Lanes w = geometry::where(counts, exp_minus(distance_sq * per_radius_sq_));
      count += geometry::where(counts, geometry::Lanes{1, 1, 1, 1});
      weight += w;
      const geometry::Lanes wx = w * x, wy = w * y, wz = w * z;
      sx += wx, sy += wy, sz += wz;
      xx += wx * x, xy += wx * y, xz += wx * z;
      yy += wy * y, yz += wy * z, zz += wz * z;
    }
    count_ = count, weight_ = weight, x_ = sx, y_ = sy, z_ = sz;
    xx_ = xx, xy_ = xy, xz_ = xz, yy_ = yy, yz_ = yz, zz_ = zz;
  }

  const occupancy::VoxelPoint& centre_;
  float radius_sq_, per_radius_sq_;
  std::size_t filled_ = 0;
  std::array<float, room> offset_x_, offset_y_, offset_z_, facing_;  // [0, filled_) are set
  geometry::Lanes count_{}, weight_{}, x_{}, y_{}, z_{}, xx_{}, xy_{}, xz_{}, yy_{}, yz_{}, zz_{};
};

/// Whether all of up to eight points belong to the surface.
bool belong_to(SurfaceId surface, const SurfaceId* of_points, unsigned count) {
  static constexpr std::array<int, 12> beyond{0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1};
  const int id = static_cast<int>(surface);
  const geometry::LaneMask wanted{id, id, id, id};
  if (count <= 4)
    return geometry::all((geometry::load_mask(of_points) == wanted) |
                         geometry::load_mask(&beyond[8 - count]));
  return geometry::all((geometry::load_mask(of_points) == wanted)) &&
         geometry::all((geometry::load_mask(of_points + 4) == wanted) |
                       geometry::load_mask(&beyond[12 - count]));
}

/// Variances of the neighbours along their principal axes, ascending, and the axis of the smallest.
struct PrincipalVariances {
  double smallest = 0, middle = 0, largest = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit; zero if ambiguous
};

/// The eigenvalues of the covariance without trigonometry: Newton from below, where the
/// characteristic polynomial is concave, climbs to the smallest; the others solve a quadratic.
PrincipalVariances principal_variances(const NeighbourSums& s) {
  const double n = s.weight;
  const Eigen::Vector3d mean = s.sum.cast<double>() / n;
  double xx = s.outer[0] / n - mean.x() * mean.x(), xy = s.outer[1] / n - mean.x() * mean.y(),
         xz = s.outer[2] / n - mean.x() * mean.z(), yy = s.outer[3] / n - mean.y() * mean.y(),
         yz = s.outer[4] / n - mean.y() * mean.z(), zz = s.outer[5] / n - mean.z() * mean.z();
  const double trace = xx + yy + zz;
  PrincipalVariances found;
  if (!(trace > 0)) return found;
  for (double* element : {&xx, &xy, &xz, &yy, &yz, &zz}) *element /= trace;
  const double minors = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz;
  const double determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  double least = 0;
  for (int k = 0; k < 30; ++k) {
    const double value = ((least - 1) * least + minors) * least - determinant;
    const double slope = (3 * least - 2) * least + minors;
    if (!(value < 0) || slope <= 0) break;
    const double step = -value / slope;
    least += step;
    if (step < 1e-9) break;
  }
  const double rest = 1 - least;
  const double half_gap = std::sqrt(std::max(0.0, rest * rest / 4 - (minors - least * rest)));
  found.smallest = least * trace;
  found.middle = (rest / 2 - half_gap) * trace;
  found.largest = (rest / 2 + half_gap) * trace;
  const Eigen::Vector3d a(xx - least, xy, xz), b(xy, yy - least, yz), c(xz, yz, zz - least);
  Eigen::Vector3d normal = a.cross(b);
  for (const Eigen::Vector3d& other : {Eigen::Vector3d(a.cross(c)), Eigen::Vector3d(b.cross(c))})
    if (other.squaredNorm() > normal.squaredNorm()) normal = other;
  if (normal.squaredNorm() > 1e-24) found.normal = normal.normalized();
  return found;
}

}  // namespace

NormalField::NormalField(const surfaces::MapView& map)
    : map_(map),
      model_(map.noise, map.grid.resolution()),
      resolution_(map.grid.resolution()),
      smallest_(map.parameters.normal_radius()),
      largest_(map.parameters.search_radius()) {}

const LocalPlane& NormalField::computed(PointId point) const {
  const std::size_t i = index_of(point);
  if (i >= planes_.size()) {
    planes_.grow_to(std::max<std::size_t>(map_.window.size(), i + 1));
    done_.resize(planes_.size(), false);
  }
  // Four times the noise, so that the noise does not hide the plane.
  const double radius = std::clamp(4 * map_.noise.sigma(map_.window[point].range_class), smallest_, largest_);
  LocalPlane plane = compute(point, radius);
  if (!plane.known && radius < largest_) plane = compute(point, largest_);
  planes_[i] = plane;
  done_[i] = true;
  return planes_[i];
}

bool NormalField::lies_off(const occupancy::VoxelPoint& p, SurfaceId id) const {
  const surfaces::SurfaceModel* surface = map_.surfaces.find(id);
  return surface != nullptr && !model_.belongs(p, surface->plane());
}

LocalPlane NormalField::compute(PointId i, double radius) const {
  constexpr float min_neighbours = 6;
  const occupancy::VoxelPoint& p = map_.window[i];
  LocalPlane plane;
  const int reach = std::max(1, static_cast<int>(radius / resolution_));
  NeighbourMoments moments(p, static_cast<float>(radius));
  SurfaceId run = 0;  // surface of the current run of neighbours
  bool off = false;
  map_.window.for_each_row_near(p.key, reach, [&](std::size_t first, unsigned count) {
    const occupancy::PointWindow::Columns& points = map_.window.columns();
    if (belong_to(run, &points.surface[first], count)) {
      if (!off) moments.add(points, first, count);
      return;
    }
    for (; count > 0; --count, ++first) {
      if (points.surface[first] != run) {
        run = points.surface[first];
        off = run != 0 && run != p.surface && lies_off(p, run);
      }
      if (!off) moments.add(points, first, 1);
    }
  });
  const NeighbourSums sums = moments.sums();
  if (sums.count < min_neighbours) return plane;
  const PrincipalVariances variances = principal_variances(sums);
  // Collinear: the second variance is no more than a voxel's rounding.
  if (variances.middle < 0.05 * variances.largest || variances.middle < 0.09 * resolution_ * resolution_)
    return plane;
  plane.known = true;
  plane.normal = variances.normal.isZero() ? p.view : variances.normal.cast<float>();
  if (plane.normal.dot(p.view) < 0) plane.normal = -plane.normal;
  return plane;
}

}  // namespace octosurf::cylinders
