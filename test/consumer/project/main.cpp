// A floor, seen once from 1.5 m above it.
#include <cstdio>

#include <octosurf/mapper.hpp>

int main() {
  octosurf::Scan scan;  // points in the sensor's frame, and where the sensor was
  for (float x = -1; x < 1; x += 0.01f)
    for (float y = -1; y < 1; y += 0.01f) scan.points.emplace_back(x, y, -1.5f);
  scan.T_map_sensor.translation() = Eigen::Vector3d(0, 0, 1.5);

  octosurf::Mapper mapper;
  mapper.insert(scan);
  mapper.drain();  // after the last scan: surfaces in what its budget has left over
  for (const octosurf::SurfacePtr& surface : mapper.snapshot()->surfaces)
    std::printf("surface %u: %.2f m², %zu polygons, normal z %.3f\n", surface->id, surface->area_m2,
                surface->polygons.size(), surface->plane.normal.z());
}
