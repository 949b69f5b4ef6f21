#include "simulation/outside.hpp"

#include <algorithm>

namespace octosurf::simulation {
namespace {

constexpr std::uint64_t paths = 64;
constexpr int turns = 16;
constexpr int enough = 2;

/// Uniform over the half sphere around `normal`.
Eigen::Vector3d direction(const Eigen::Vector3d& normal, Random& random) {
  const Eigen::Vector3d d = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
  return d.dot(normal) < 0 ? Eigen::Vector3d(-d) : d;
}

}  // namespace

Scene scene_of(const TriangleMesh& mesh, const std::string& name) {
  Scene scene;
  scene.name = name;
  Solid solid;
  solid.object = add_object(scene, "terrain");
  for (const auto& t : mesh.triangles)
    solid.facets.push_back({{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, "", false});
  scene.solids.push_back(std::move(solid));
  return scene;
}

Outside::Outside(const TriangleMesh& mesh, const Scene& scene)
    : caster_(scene, {}, 0), offset_(4 * mesh.precision) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex);
  reach_ = 2 * box.diagonal().norm();
  for (const auto& t : mesh.triangles)
    normals_.push_back((mesh.vertices[t[1]] - mesh.vertices[t[0]])
                           .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
                           .normalized());
}

bool Outside::reached_from(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
  int left = 0;
  for (std::uint64_t path = 0; path < paths; ++path) {
    Random random(path, 0);
    Eigen::Vector3d at = p;
    Eigen::Vector3d side = normal;
    for (int turn = 0; turn <= turns; ++turn) {
      const Eigen::Vector3d d = direction(side, random);
      const std::vector<Eigen::Vector3f> ray{d.cast<float>()};
      const Hit hit = caster_.cast(at, ray, reach_)[0];
      if (hit.t == 0) {
        if (++left == enough) return true;
        break;
      }
      side = normals_[hit.facet].dot(d) < 0 ? normals_[hit.facet] : Eigen::Vector3d(-normals_[hit.facet]);
      at += static_cast<double>(hit.t) * d + offset_ * side;
    }
  }
  return false;
}

}  // namespace octosurf::simulation
