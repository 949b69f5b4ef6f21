#include "alignment/surfaces_by_hand.hpp"

namespace octosurf::test {

std::shared_ptr<const Snapshot> map_of_rectangles(const Scene& scene, const Eigen::Vector3d& inside,
                                                  double resolution) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->revision = 1;
  snapshot->resolution = resolution;
  for (const Rectangle& rectangle : scene.rectangles) {
    auto surface = std::make_shared<Surface>();
    surface->id = static_cast<SurfaceId>(snapshot->surfaces.size() + 1);
    surface->resolution = resolution;
    Eigen::Vector3d u = rectangle.edge_u, v = rectangle.edge_v;
    if (u.cross(v).dot(inside - rectangle.corner) < 0) std::swap(u, v);
    const double width = u.norm(), height = v.norm();
    surface->plane.normal = u.cross(v).normalized();
    surface->plane.offset = surface->plane.normal.dot(rectangle.corner);
    surface->T_map_surface.linear() << u / width, v / height, surface->plane.normal;
    surface->T_map_surface.translation() = rectangle.corner;
    surface->polygons = {{{{0, 0}, {width, 0}, {width, height}, {0, height}}, {}}};
    for (const Eigen::Vector2d& vertex : surface->polygons[0].outer)
      surface->boundary.push_back(surface->to_map(vertex));
    surface->area_m2 = width * height;
    surface->revision = 1;
    surface->covariance = Eigen::Vector3d(1e-9, 1e-9, 1e-9).asDiagonal();
    snapshot->surfaces.push_back(std::move(surface));
  }
  return snapshot;
}

Scene furnished_room() {
  Scene scene;
  scene.rectangle({0, 0, 0}, {4, 0, 0}, {0, 5, 0}).rectangle({0, 0, 0}, {4, 0, 0}, {0, 0, 2.5});
  scene.rectangle({0, 5, 0}, {4, 0, 0}, {0, 0, 2.5}).rectangle({0, 0, 0}, {0, 5, 0}, {0, 0, 2.5});
  scene.rectangle({4, 0, 0}, {0, 5, 0}, {0, 0, 2.5});
  scene.rectangle({0.4, 3.2, 0.74}, {1.3, 0, 0}, {0, 0.8, 0});  // a table
  scene.rectangle({3.2, 3.5, 0}, {0, 1.5, 0}, {0, 0, 2})
      .rectangle({3.2, 3.5, 0}, {0.8, 0, 0}, {0, 0, 2});  // a cupboard
  return scene;
}

Eigen::Vector3d any_direction(std::mt19937_64& rng) {
  std::normal_distribution<double> gauss(0, 1);
  return Eigen::Vector3d(gauss(rng), gauss(rng), gauss(rng)).normalized();
}

Twist any_twist(std::mt19937_64& rng, double translation_m, double rotation_rad) {
  Twist twist;
  twist << rotation_rad * any_direction(rng), translation_m * any_direction(rng);
  return twist;
}

}  // namespace octosurf::test
