#include "simulation/mesh_faces.hpp"

#include "simulation/coplanar.hpp"
#include "simulation/outside.hpp"
#include "simulation/plane_cells.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>
#include <map>

namespace octosurf::simulation {
namespace {

namespace bg = boost::geometry;
using BoostPoint = bg::model::point<double, 3, bg::cs::cartesian>;
using Box = bg::model::box<BoostPoint>;

/// Where a plane is cut, m in front of its outermost corner, in units of the mesh's precision: far enough for
/// what stands on it not to be missed by rounding. Parts that slope at 10° are cut half a millimetre too far
/// out.
constexpr double contact_precisions = 8;

/// Triangles by place.
class TriangleIndex {
 public:
  explicit TriangleIndex(const TriangleMesh& mesh) : mesh_(mesh) {
    std::vector<std::pair<Box, std::size_t>> boxes;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) boxes.emplace_back(box_of({i}), i);
    tree_ = decltype(tree_)(boxes.begin(), boxes.end());
  }

  /// Those whose boxes come within `margin` of the triangles'; ascending.
  std::vector<std::size_t> near(const std::vector<std::size_t>& triangles, double margin) const {
    std::vector<std::size_t> found;
    for (auto it = tree_.qbegin(bg::index::intersects(box_of(triangles, margin))); it != tree_.qend(); ++it)
      found.push_back(it->second);
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  Box box_of(const std::vector<std::size_t>& triangles, double margin = 0) const {
    Eigen::AlignedBox3d box;
    for (const std::size_t i : triangles)
      for (const auto vertex : mesh_.triangles[i]) box.extend(mesh_.vertices[vertex]);
    const Eigen::Vector3d min = box.min().array() - margin;
    const Eigen::Vector3d max = box.max().array() + margin;
    return {{min.x(), min.y(), min.z()}, {max.x(), max.y(), max.z()}};
  }

  const TriangleMesh& mesh_;
  bg::index::rtree<std::pair<Box, std::size_t>, bg::index::rstar<16>> tree_;
};

/// One side of a plane, its triangles drawn in the plane.
class PlaneSide {
 public:
  PlaneSide(const TriangleMesh& mesh, const CoplanarTriangles& plane, bool back)
      : mesh_(mesh), triangles_(plane.triangles), T_scene_face_(plane.T_scene_plane) {
    if (back) T_scene_face_ = T_scene_face_ * Eigen::AngleAxisd(std::acos(-1.0), Eigen::Vector3d::UnitX());
    T_face_scene_ = T_scene_face_.inverse();
    for (const std::size_t i : triangles_)
      for (const auto vertex : mesh.triangles[i]) height_ = std::max(height_, local(vertex).z());
    height_ += contact_precisions * mesh.precision;
  }

  const Eigen::Isometry3d& T_scene_face() const { return T_scene_face_; }
  double height() const { return height_; }

  /// The rims of the plane's own triangles (edges with one on either side left out), and where `others` cross
  /// the plane at `height`.
  std::vector<Segment2> segments(const std::vector<std::size_t>& others) const {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::array<bool, 2>> sides;
    for (const std::size_t i : triangles_)
      for (int k = 0; k < 3; ++k) {
        const auto& t = mesh_.triangles[i];
        const auto edge = std::minmax(t[k], t[(k + 1) % 3]);
        const double left = distance_left_of(local(edge.first).head<2>(), local(edge.second).head<2>(),
                                             local(t[(k + 2) % 3]).head<2>());
        sides[edge][left > 0 ? 0 : 1] = true;
      }
    std::vector<Segment2> segments;
    for (const auto& [edge, side] : sides)
      if (!side[0] || !side[1])
        segments.push_back({local(edge.first).head<2>(), local(edge.second).head<2>()});
    for (const std::size_t i : others) add_section(mesh_.triangles[i], segments);
    return segments;
  }

  /// True in the plane's triangles, their edges included: the middle of a cell may well lie on one between
  /// two.
  bool covers(const Eigen::Vector2d& p) const {
    return std::any_of(triangles_.begin(), triangles_.end(), [&](std::size_t i) {
      double least = 0;
      double most = 0;
      for (int k = 0; k < 3; ++k) {
        const double left = distance_left_of(local(mesh_.triangles[i][k]).head<2>(),
                                             local(mesh_.triangles[i][(k + 1) % 3]).head<2>(), p);
        least = std::min(least, left);
        most = std::max(most, left);
      }
      return least > -mesh_.precision || most < mesh_.precision;
    });
  }

 private:
  static double distance_left_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                 const Eigen::Vector2d& p) {
    return ((b - a).x() * (p - a).y() - (b - a).y() * (p - a).x()) / (b - a).norm();
  }
  Eigen::Vector3d local(std::uint32_t vertex) const { return T_face_scene_ * mesh_.vertices[vertex]; }

  void add_section(const std::array<std::uint32_t, 3>& triangle, std::vector<Segment2>& segments) const {
    std::vector<Eigen::Vector2d> ends;
    for (int k = 0; k < 3; ++k) {
      // An edge is cut at the same place, to the bit, for both of its triangles.
      const auto [i, j] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      const Eigen::Vector3d a = local(i);
      const Eigen::Vector3d b = local(j);
      const double da = a.z() - height_;
      const double db = b.z() - height_;
      if ((da < 0) != (db < 0)) ends.emplace_back((a + (b - a) * (da / (da - db))).head<2>());
    }
    if (ends.size() == 2) segments.push_back({ends[0], ends[1]});
  }

  const TriangleMesh& mesh_;
  const std::vector<std::size_t>& triangles_;
  Eigen::Isometry3d T_scene_face_, T_face_scene_;
  double height_ = 0;
};

std::string name_of(const Eigen::Vector3d& normal) {
  constexpr double level = 0.996, wall = 0.0872;  // within 5°
  if (normal.z() > level) return "terrain/level";
  if (normal.z() > wall) return "terrain/slope";
  return normal.z() < -wall ? "terrain/overhang" : "terrain/wall";
}

}  // namespace

MeshFaces find_mesh_faces(const TriangleMesh& mesh) {
  MeshFaces faces;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    faces.normals.push_back((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized());
    faces.plane_of_side.push_back({MeshFaces::none, MeshFaces::none});
  }
  const Outside outside(mesh, scene_of(mesh, ""));
  const TriangleIndex index(mesh);
  for (const auto& plane : coplanar_triangles(mesh)) {
    const auto others =
        index.near(plane.triangles, coplanar_tolerance(mesh) + contact_precisions * mesh.precision);
    for (const bool back : {false, true}) {
      const PlaneSide side(mesh, plane, back);
      const Eigen::Vector3d normal = side.T_scene_face().linear().col(2);
      auto polygons =
          cells_where(side.segments(others), coplanar_tolerance(mesh), [&](const Eigen::Vector2d& p) {
            const Eigen::Vector3d before = side.T_scene_face() * Eigen::Vector3d(p.x(), p.y(), side.height());
            return side.covers(p) && outside.reached_from(before, normal);
          });
      if (polygons.empty()) continue;
      for (const std::size_t i : plane.triangles)
        faces.plane_of_side[i][faces.normals[i].dot(normal) > 0 ? 0 : 1] = faces.planes.size();
      faces.planes.push_back({name_of(normal), side.T_scene_face(), std::move(polygons)});
    }
  }
  return faces;
}

}  // namespace octosurf::simulation
