#include "place_query.hpp"

#include "answers.hpp"
#include "surface_table.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>

#include <octosurf/queries.hpp>

namespace octosurf {
namespace {

Eigen::Vector3d point_at(const std::vector<double>& values, std::size_t first) {
  return {values[first], values[first + 1], values[first + 2]};
}

void print_surfaces(const SurfaceIndex& index, const std::vector<SurfaceId>& ids, const Eigen::Vector3d& up,
                    bool json) {
  if (json) {
    std::printf("%s\n", surfaces_json(ids).c_str());
    return;
  }
  std::vector<SurfacePtr> surfaces;
  for (const SurfacePtr& surface : index.snapshot().surfaces)
    if (std::binary_search(ids.begin(), ids.end(), surface->id)) surfaces.push_back(surface);
  print_table(surfaces, up);
}

void print_hit(const std::optional<RayHit>& hit, bool json) {
  if (json) {
    std::printf("%s\n", hit_json(hit).c_str());
  } else if (hit) {
    std::printf("surface   %u, from its %s\npoint     %.4f %.4f %.4f\ndistance  %.4f m\n", hit->id,
                hit->front ? "front" : "back", hit->point.x(), hit->point.y(), hit->point.z(), hit->distance);
  } else {
    std::printf("nothing   the ray meets no surface\n");
  }
}

void print_voxel(const OccupancyView::Voxel& voxel, bool json) {
  if (json) {
    std::printf("%s\n", voxel_json(voxel).c_str());
    return;
  }
  std::printf("state     %s\n", state_name(voxel.state));
  if (voxel.state != OccupancyView::State::unknown) std::printf("log-odds  %.3f\n", voxel.log_odds);
  if (voxel.surface != 0)
    std::printf("surface   %u\n", voxel.surface);
  else if (voxel.state == OccupancyView::State::occupied)
    std::printf("surface   none yet\n");
}

}  // namespace

void add_place_options(CLI::Option_group& question, PlaceQuery& query) {
  question.add_option("--box", query.box, "X Y Z X Y Z: surfaces in the box between two corners")
      ->expected(6);
  question.add_option("--sphere", query.sphere, "X Y Z R: surfaces within R metres of a point")->expected(4);
  question
      .add_option("--ray", query.ray,
                  "X Y Z DX DY DZ: the first surface along a ray from a point, in a direction")
      ->expected(6);
  question.add_option("--voxel", query.voxel, "X Y Z: the voxel at this point: its state and its surface")
      ->expected(3);
}

void answer(const Map& map, const PlaceQuery& query, const Eigen::Vector3d& up, bool json) {
  const SurfaceIndex index(map.snapshot());
  if (!query.box.empty()) {
    const Eigen::Vector3d a = point_at(query.box, 0), b = point_at(query.box, 3);
    print_surfaces(index, index.in(ConvexSpace::box({a.cwiseMin(b), a.cwiseMax(b)})), up, json);
  } else if (!query.sphere.empty()) {
    print_surfaces(index, index.in_sphere(point_at(query.sphere, 0), query.sphere[3]), up, json);
  } else if (!query.ray.empty()) {
    print_hit(index.first_on_ray(point_at(query.ray, 0), point_at(query.ray, 3)), json);
  } else {
    print_voxel(map.octree().at(point_at(query.voxel, 0)), json);
  }
}

}  // namespace octosurf
