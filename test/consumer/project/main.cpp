#include <cstdio>

#include <octosurf/mapper.hpp>

int main() {
  octosurf::Scan scan;  // a floor 1.5 m below the sensor, in the sensor's frame
  for (int i = 0; i < 40000; ++i)
    scan.points.emplace_back(0.01F * float(i % 200) - 1, 0.01F * float(i / 200) - 1, -1.5F);
  scan.T_map_sensor.translation().z() = 1.5;

  octosurf::Mapper mapper;
  mapper.insert(scan);
  for (const octosurf::SurfacePtr& surface : mapper.snapshot()->surfaces)
    std::printf("surface %ju: %.2f m², %zu polygons, normal z %.3f\n", surface->id, surface->area_m2,
                surface->polygons.size(), surface->plane.normal.z());
}
