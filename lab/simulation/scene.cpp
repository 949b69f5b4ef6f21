#include "simulation/scene.hpp"

#include <algorithm>
#include <map>
#include <numbers>
#include <utility>

namespace octosurf::simulation {
namespace {

/// Lateral surface facets of a cylinder: at r = 0.2 m a chord stays within 0.1 mm of the circle.
constexpr int cylinder_sides = 96;
/// Subdivisions of the icosahedron: 1280 triangles, 0.4 mm off the sphere at r = 0.15 m.
constexpr int sphere_subdivisions = 3;

Eigen::Vector3d at(const Eigen::Vector2d& p, double z) { return {p.x(), p.y(), z}; }

std::vector<Eigen::Vector3d> icosahedron() {
  const double phi = std::numbers::phi;
  std::vector<Eigen::Vector3d> vertices;
  for (const double a : {-1.0, 1.0})
    for (const double b : {-phi, phi}) {
      vertices.emplace_back(0, a, b);
      vertices.emplace_back(a, b, 0);
      vertices.emplace_back(b, 0, a);
    }
  return vertices;
}

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Triangles of the unit sphere, counter-clockwise from outside.
std::vector<Triangle> unit_sphere() {
  const auto vertices = icosahedron();
  std::vector<Triangle> triangles;
  const auto adjacent = [&](std::size_t i, std::size_t j) {
    return std::abs((vertices[i] - vertices[j]).norm() - 2) < 1e-9;
  };
  for (std::size_t i = 0; i < vertices.size(); ++i)
    for (std::size_t j = i + 1; j < vertices.size(); ++j)
      for (std::size_t k = j + 1; k < vertices.size(); ++k) {
        if (!adjacent(i, j) || !adjacent(j, k) || !adjacent(i, k)) continue;
        Triangle t{vertices[i].normalized(), vertices[j].normalized(), vertices[k].normalized()};
        if ((t[1] - t[0]).cross(t[2] - t[0]).dot(t[0]) < 0) std::swap(t[1], t[2]);
        triangles.push_back(t);
      }
  for (int level = 0; level < sphere_subdivisions; ++level) {
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : triangles) {
      const Eigen::Vector3d ab = (a + b).normalized();
      const Eigen::Vector3d bc = (b + c).normalized();
      const Eigen::Vector3d ca = (c + a).normalized();
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  return triangles;
}

}  // namespace

bool Scene::changes() const {
  return std::any_of(objects.begin(), objects.end(),
                     [](const Object& o) { return o.stands[0] != o.stands[1]; });
}

std::size_t add_object(Scene& scene, const std::string& name, bool before, bool after) {
  scene.objects.push_back({name, {before, after}});
  return scene.objects.size() - 1;
}

void add_prism(Scene& scene, std::size_t object, const Eigen::Isometry3d& T, const Ring2& base, double height,
               bool curved) {
  static const std::array<const char*, 4> box_sides{"front", "right", "back", "left"};
  Solid solid;
  solid.object = object;
  const std::size_t n = base.size();
  Facet bottom{{}, "bottom", false};
  Facet top{{}, "top", false};
  for (std::size_t i = 0; i < n; ++i) {
    const auto& a = base[i];
    const auto& b = base[(i + 1) % n];
    top.ring.push_back(T * at(a, height));
    bottom.ring.push_back(T * at(base[n - 1 - i], 0));
    solid.facets.push_back({{T * at(a, 0), T * at(b, 0), T * at(b, height), T * at(a, height)},
                            n == 4 ? box_sides[i] : "side" + std::to_string(i + 1),
                            curved});
  }
  solid.facets.push_back(std::move(bottom));
  solid.facets.push_back(std::move(top));
  scene.solids.push_back(std::move(solid));
}

void add_box(Scene& scene, std::size_t object, const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  const Ring2 base{{min.x(), min.y()}, {max.x(), min.y()}, {max.x(), max.y()}, {min.x(), max.y()}};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = min.z();
  add_prism(scene, object, T, base, max.z() - min.z());
}

void add_box(Scene& scene, std::size_t object, const Eigen::Isometry3d& T, const Eigen::Vector3d& size) {
  const double x = size.x() / 2;
  const double y = size.y() / 2;
  const Eigen::Isometry3d base = T * Eigen::Translation3d(0, 0, -size.z() / 2);
  add_prism(scene, object, base, {{-x, -y}, {x, -y}, {x, y}, {-x, y}}, size.z());
}

void add_cylinder(Scene& scene, std::size_t object, const Eigen::Vector3d& base, double radius,
                  double height) {
  Ring2 ring;
  for (int i = 0; i < cylinder_sides; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / cylinder_sides;
    ring.emplace_back(radius * std::cos(angle_rad), radius * std::sin(angle_rad));
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = base;
  add_prism(scene, object, T, ring, height, true);
}

void add_sphere(Scene& scene, std::size_t object, const Eigen::Vector3d& center, double radius) {
  Solid solid;
  solid.object = object;
  for (const auto& triangle : unit_sphere()) {
    Facet facet{{}, "sphere", true};
    for (const auto& vertex : triangle) facet.ring.emplace_back(center + radius * vertex);
    solid.facets.push_back(std::move(facet));
  }
  scene.solids.push_back(std::move(solid));
}

void add_wall(Scene& scene, std::size_t object, const Eigen::Vector3d& min, const Eigen::Vector3d& max,
              const std::vector<Door>& doors) {
  double x = min.x();
  for (const auto& door : doors) {
    add_box(scene, object, {x, min.y(), min.z()}, {door.from, max.y(), max.z()});
    add_box(scene, object, {door.from, min.y(), min.z() + door.height}, {door.to, max.y(), max.z()});
    x = door.to;
  }
  add_box(scene, object, {x, min.y(), min.z()}, max);
}

}  // namespace octosurf::simulation
