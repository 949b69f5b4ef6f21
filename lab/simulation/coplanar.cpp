#include "simulation/coplanar.hpp"

#include "geometry/symmetric.hpp"
#include "simulation/planar.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

namespace octosurf::simulation {
namespace {

constexpr double half_depth_step = 0.5e-3;  // m
const double min_cos = std::cos(5 * std::numbers::pi / 180);
constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

struct FlatTriangle {
  std::array<Eigen::Vector3d, 3> corners;
  Eigen::Vector3d normal;
  double area = 0;
};

/// A plane through area-weighted corners. It is fitted anew whenever its area has doubled: the first
/// triangle's normal alone is too rough for a piece much larger than it.
class GrowingPlane {
 public:
  explicit GrowingPlane(const FlatTriangle& seed) : normal_(seed.normal), point_(seed.corners[0]) {
    add(seed);
  }

  bool holds(const FlatTriangle& t, double tolerance) const {
    return std::abs(normal_.dot(t.normal)) >= min_cos &&
           std::all_of(t.corners.begin(), t.corners.end(), [&](const Eigen::Vector3d& corner) {
             return std::abs(normal_.dot(corner - point_)) <= tolerance;
           });
  }

  void add(const FlatTriangle& t) {
    for (const auto& corner : t.corners) {
      const Eigen::Vector3d v = corner - origin(t);
      sum_ += t.area * v;
      squares_ += t.area * v * v.transpose();
    }
    area_ += t.area;
    if (area_ >= 2 * fitted_area_) fit();
  }

  void fit() {
    const double weight = 3 * area_;
    const Eigen::Vector3d mean = sum_ / weight;
    const Eigen::Matrix3d scatter = squares_ / weight - mean * mean.transpose();
    const Eigen::Vector3d n = geometry::principal_axes(scatter).vectors.col(0);
    normal_ = n.dot(normal_) < 0 ? Eigen::Vector3d(-n) : n;
    point_ = origin_ + mean;
    fitted_area_ = area_;
  }

  const Eigen::Vector3d& normal() const { return normal_; }
  const Eigen::Vector3d& point() const { return point_; }

 private:
  /// Moments are taken about the first corner: about the scene's origin their squares would lose digits.
  const Eigen::Vector3d& origin(const FlatTriangle& t) {
    if (area_ == 0 && sum_.isZero(0) && squares_.isZero(0)) origin_ = t.corners[0];
    return origin_;
  }

  Eigen::Vector3d normal_, point_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero(), sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();
  double area_ = 0, fitted_area_ = 0;
};

std::vector<FlatTriangle> flat_triangles(const TriangleMesh& mesh) {
  std::vector<FlatTriangle> flat;
  for (const auto& t : mesh.triangles) {
    FlatTriangle& f = flat.emplace_back();
    for (int k = 0; k < 3; ++k) f.corners[k] = mesh.vertices[t[k]];
    const Eigen::Vector3d n = (f.corners[1] - f.corners[0]).cross(f.corners[2] - f.corners[0]);
    f.area = n.norm() / 2;
    f.normal = n.normalized();
  }
  return flat;
}

std::vector<std::vector<std::size_t>> neighbours(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::size_t>> at_edge;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k)
      at_edge[std::minmax(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3])].push_back(i);
  std::vector<std::vector<std::size_t>> adjacent(mesh.triangles.size());
  for (const auto& [edge, triangles] : at_edge)
    for (const std::size_t a : triangles)
      for (const std::size_t b : triangles)
        if (a != b) adjacent[a].push_back(b);
  return adjacent;
}

/// Connected pieces, each grown from the largest triangle that is left.
std::vector<std::vector<std::size_t>> grow_pieces(const TriangleMesh& mesh,
                                                  const std::vector<FlatTriangle>& flat, double tolerance) {
  const auto adjacent = neighbours(mesh);
  std::vector<std::size_t> order(flat.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return flat[a].area > flat[b].area; });
  std::vector<bool> taken(flat.size(), false);
  std::vector<std::vector<std::size_t>> pieces;
  for (const std::size_t seed : order) {
    if (taken[seed]) continue;
    taken[seed] = true;
    auto& piece = pieces.emplace_back(1, seed);
    GrowingPlane plane(flat[seed]);
    for (std::size_t next = 0; next < piece.size(); ++next)
      for (const std::size_t i : adjacent[piece[next]])
        if (!taken[i] && plane.holds(flat[i], tolerance)) {
          taken[i] = true;
          piece.push_back(i);
          plane.add(flat[i]);
        }
  }
  return pieces;
}

/// Planes by their normals' cells on the sphere's cube, so that not all need to be tried. Cells are wider
/// than min_cos, so that a plane that holds a triangle lies in a neighbouring one.
class PlaneIndex {
 public:
  static constexpr double edge = 0.2;

  void add(const Eigen::Vector3d& n, std::size_t plane) { cells_[cell(n)].push_back(plane); }

  /// The first plane added for which `fits` holds; of normals of either sign.
  template <class Fits>
  std::size_t find(const Eigen::Vector3d& n, Fits&& fits) const {
    std::size_t best = none;
    for (const double sign : {1.0, -1.0})
      for (int i = 0; i < 27; ++i) {
        const std::array<int, 3> c = cell(sign * n);
        const auto found = cells_.find({c[0] + i % 3 - 1, c[1] + i / 3 % 3 - 1, c[2] + i / 9 - 1});
        if (found == cells_.end()) continue;
        for (const std::size_t plane : found->second)
          if (plane < best && fits(plane)) best = plane;
      }
    return best;
  }

 private:
  static std::array<int, 3> cell(const Eigen::Vector3d& n) {
    return {static_cast<int>(std::floor(n.x() / edge)), static_cast<int>(std::floor(n.y() / edge)),
            static_cast<int>(std::floor(n.z() / edge))};
  }

  std::map<std::array<int, 3>, std::vector<std::size_t>> cells_;
};

}  // namespace

double coplanar_tolerance(const TriangleMesh& mesh) { return std::max(half_depth_step, mesh.precision); }

std::vector<CoplanarTriangles> coplanar_triangles(const TriangleMesh& mesh) {
  const double tolerance = coplanar_tolerance(mesh);
  const std::vector<FlatTriangle> flat = flat_triangles(mesh);
  std::vector<GrowingPlane> planes;
  std::vector<CoplanarTriangles> groups;
  PlaneIndex index;
  for (const auto& piece : grow_pieces(mesh, flat, tolerance)) {
    const std::size_t home = index.find(flat[piece[0]].normal, [&](std::size_t plane) {
      return std::all_of(piece.begin(), piece.end(),
                         [&](std::size_t i) { return planes[plane].holds(flat[i], tolerance); });
    });
    if (home != none) {
      groups[home].triangles.insert(groups[home].triangles.end(), piece.begin(), piece.end());
      continue;
    }
    GrowingPlane& plane = planes.emplace_back(flat[piece[0]]);
    for (std::size_t k = 1; k < piece.size(); ++k) plane.add(flat[piece[k]]);
    plane.fit();
    index.add(plane.normal(), planes.size() - 1);
    groups.push_back({face_frame(plane.normal(), plane.point()), piece});
  }
  return groups;
}

}  // namespace octosurf::simulation
